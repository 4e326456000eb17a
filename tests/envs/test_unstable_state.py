import base64
import json
import logging

import numpy as np
import pytest

from clutter6d.cli import run
from clutter6d.envs.tasks import TaskSource
from clutter6d.envs.unstable_state import replay_unstable
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.errors import InvalidFileError, InvalidValueError
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set

SCENES = make_box_scene_set(2)
VIOLENT_RAD_S = 1e12


@pytest.fixture
def broken(tmp_path, caplog):
    """Two environments of which the second becomes invalid in its third step."""
    env = ClutterVectorEnv(2, split=SCENES, threads=1, unstable_dir=tmp_path / "unstable")
    env.reset(seed=0, options={"scene_id": "boxes-1", "pair": [0, 1]})
    still = np.zeros((2, 7), dtype=np.float32)
    env.step(still)
    env.step(still)
    env.unwrapped._episodes.core.batch.arm_qvel[1, 0] = VIOLENT_RAD_S
    with caplog.at_level(logging.WARNING):
        result = env.step(still)
    return env, result, tmp_path / "unstable" / "boxes-1@1-2.json", caplog.text


def test_an_invalid_step_ends_the_episode_and_nothing_that_is_not_finite_comes_out(broken):
    _, (observations, rewards, terminated, truncated, info), _, _ = broken
    assert terminated.tolist() == [False, True]
    assert not truncated.any()
    assert info["outcome"].tolist() == [None, "unstable"]
    assert np.isfinite(rewards).all()
    assert all(np.isfinite(value).all() for value in observations.values())


def test_the_guard_names_scene_pair_and_step_and_tells_where_the_state_is(broken):
    _, _, path, log = broken
    assert f"scene boxes-1, pair 1, step 2; look again with: clutter6d replay {path}" in log
    assert path.is_file()


def test_the_saved_step_becomes_invalid_again_when_it_is_replayed(broken):
    assert replay_unstable(broken[2], TaskSource(SCENES))


def test_a_sound_step_is_reported_as_such(broken):
    path = broken[2]
    content = json.loads(path.read_text())
    env = ClutterVectorEnv(1, split=SCENES, threads=1)
    env.reset(options={"scene_id": "boxes-1", "pair": 1})
    state = env._episodes.core.batch.states[0]
    content["state_base64"] = base64.b64encode(state.tobytes()).decode()
    path.write_text(json.dumps(content))
    assert not replay_unstable(path, TaskSource(SCENES))


def test_other_scenes_and_a_state_of_another_layout_are_refused(broken):
    path = broken[2]
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"scenes_sha256": "c" * 64}))
    with pytest.raises(InvalidValueError, match="other scenes"):
        replay_unstable(path, TaskSource(SCENES))
    path.write_text(json.dumps(content | {"state_base64": "AAAAAAAAAAA="}))
    with pytest.raises(InvalidFileError, match="has 1 numbers"):
        replay_unstable(path, TaskSource(SCENES))
    path.write_text(json.dumps(content | {"state_base64": "not base64"}))
    with pytest.raises(InvalidFileError, match="cannot be decoded"):
        replay_unstable(path, TaskSource(SCENES))


def test_the_command_replays_it(broken, tmp_path, capsys):
    path = broken[2]
    scenes = write_box_scene_set(tmp_path / "scenes", 2)
    path.write_text(json.dumps(json.loads(path.read_text()) | {"scenes_sha256": scenes.sha256}))
    assert run(["replay", str(path), "--scenes", str(tmp_path / "scenes")]) == 0
    assert "boxes-1@1-2: the step becomes invalid again" in capsys.readouterr().out
    assert run(["replay", str(path)]) == 2
    assert "name them by --scenes" in capsys.readouterr().err
