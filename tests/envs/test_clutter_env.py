import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import clutter6d  # noqa: F401 - registers the environments
from clutter6d.envs.clutter_env import ClutterEnv
from clutter6d.errors import InvalidValueError
from tests.scene_fixtures import make_box_scene_set

SCENES = make_box_scene_set(3)


@pytest.mark.parametrize("track", ["Sparse", "Moderate", "Dense"])
def test_gymnasiums_checker_passes_without_a_warning(track):
    env = gymnasium.make(f"Clutter6D-{track}-v1", split=f"{track.lower()}-test", render_mode="rgb_array")
    check_env(env.unwrapped)
    env.close()


def test_an_id_can_be_given_another_split_of_its_track():
    env = gymnasium.make("Clutter6D-Sparse-v1", split="sparse-test")
    _, info = env.reset(seed=0)
    assert info["scene_id"].startswith("sparse-2-")
    with pytest.raises(InvalidValueError, match="of the track dense, not sparse"):
        gymnasium.make("Clutter6D-Sparse-v1", split="dense-test")


def test_info_is_made_of_plain_python_values():
    env = ClutterEnv(split=SCENES)
    _, info = env.reset(seed=0)
    assert {name: type(value) for name, value in info.items()} == {
        "scene_id": str,
        "pair": int,
        "position_error_m": float,
        "planar_error_m": float,
        "rotation_error_rad": float,
    }
    _, reward, terminated, truncated, info = env.step(np.zeros(7, dtype=np.float32))
    assert (type(reward), terminated, truncated) == (float, False, False)
    assert info["outcome"] is None
    assert info["is_success"] is False
    assert sum(info["reward_terms"].values()) == pytest.approx(reward)


def test_episodes_follow_the_seed():
    env = ClutterEnv(split=SCENES)
    first = [env.reset(seed=7)[1], env.reset()[1], env.reset()[1]]
    again = [env.reset(seed=7)[1], env.reset()[1], env.reset()[1]]
    assert first == again


def test_the_frame_moves_with_the_robot():
    env = ClutterEnv(split=SCENES, render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    for _ in range(3):
        env.step(np.full(7, 0.1, dtype=np.float32))
    assert (env.render() != before).any()
    env.close()
    assert ClutterEnv(split=SCENES).render() is None


def test_an_action_of_another_shape_is_refused():
    env = ClutterEnv(split=SCENES)
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match=r"shape \(6,\), expected \(7,\)"):
        env.step(np.zeros(6, dtype=np.float32))
