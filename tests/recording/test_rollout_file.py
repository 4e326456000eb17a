"""Rollouts as Parquet: what was simulated comes back, by our own reader and by pandas alone."""

import json

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.recording import read_rollouts
from clutter6d.recording.recording import RecordingSettings, record_episodes
from clutter6d.recording.rollout_file import RolloutRecorder
from clutter6d.recording.rollout_table import CLOUD_SHAPES, OBJECT_SIZES, STATE_SIZES
from tests.recording.recorded import STEPS, files, known_episodes, random_episodes, stacked


class Keeping(RolloutRecorder):
    """Also keeps the rollouts in memory, to be compared."""

    def add(self, rollout, scene, model):
        self.kept = [*getattr(self, "kept", []), rollout]
        super().add(rollout, scene, model)


def record(episodes, folder, *, point_clouds=False, stop_after=None):
    settings = RecordingSettings(run=episodes.settings, point_clouds=point_clouds)
    recorder = Keeping(folder, settings, episodes.keys)
    for number, _ in enumerate(record_episodes(episodes, [recorder], point_clouds=point_clouds), 1):
        if number == stop_after:
            return recorder
    recorder.finish()
    return recorder


@pytest.fixture(scope="module")
def episodes(tmp_path_factory):
    return random_episodes(tmp_path_factory.mktemp("evaluation"))


@pytest.fixture(scope="module", params=[False, True], ids=["states", "clouds"])
def recorded(request, episodes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rollouts")
    return folder, record(episodes, folder, point_clouds=request.param).kept


def arrays(rollout) -> dict[str, np.ndarray]:
    names = [*STATE_SIZES, *OBJECT_SIZES]
    found = {name: getattr(rollout.states, name) for name in names}
    if rollout.states.clouds is not None:
        found |= {name: getattr(rollout.states.clouds, name) for name in CLOUD_SHAPES}
    found |= {"actions": rollout.actions, "reward": rollout.rewards.total, "fine": rollout.rewards.fine}
    return found | {"position": rollout.errors.position_m, "rotation": rollout.errors.rotation_rad}


def test_what_was_simulated_is_read_back_to_the_bit(recorded, episodes):
    folder, kept = recorded
    read = list(read_rollouts(folder))
    assert [rollout.row.key for rollout in read] == list(episodes.keys)
    for before, after in zip(kept, read, strict=True):
        assert (before.row, before.task, before.object_names) == (after.row, after.task, after.object_names)
        assert arrays(before).keys() == arrays(after).keys()
        for name, value in arrays(before).items():
            assert value.dtype == arrays(after)[name].dtype, name
            assert np.array_equal(value, arrays(after)[name]), name


def test_pandas_alone_reads_the_columns(recorded):
    folder, kept = recorded
    steps, episodes = pd.read_parquet(folder / "steps.parquet"), pd.read_parquet(folder / "episodes.parquet")
    assert len(steps) == 4 * STEPS
    assert len(episodes) == 4
    own = steps[(steps.scene_id == "boxes-1") & (steps.pair == 0)]
    assert np.array_equal(stacked(own.action), kept[2].actions)
    assert np.array_equal(stacked(own.object_poses).reshape(STEPS, -1, 7), kept[2].states.object_poses[:-1])
    terms = [name for name in steps if name.startswith("reward_")]
    assert np.allclose(steps[terms].sum(axis=1), steps.reward)
    assert np.array_equal(stacked(episodes.final_hand_state)[2], kept[2].states.hand_state[-1])
    assert set(episodes.task) == {"move the brown box to the goal pose"}


def test_an_episode_is_a_row_group_and_the_file_names_its_schema(recorded):
    file = pq.ParquetFile(recorded[0] / "steps.parquet")
    assert [file.metadata.row_group(group).num_rows for group in range(file.num_row_groups)] == [STEPS] * 4
    header = json.loads(file.schema_arrow.metadata[b"clutter6d"])
    assert header["schema_version"] == 1
    assert header["settings"]["run"]["policy"] == "random"


def test_flags_tell_how_an_episode_ended(tmp_path):
    record(known_episodes(tmp_path / "evaluation"), tmp_path / "rollouts")
    steps = pd.read_parquet(tmp_path / "rollouts" / "steps.parquet")
    last = steps.groupby(["scene_id", "pair"], sort=True).tail(1).set_index(["scene_id", "pair"])
    assert last.loc[("boxes-0", 0), ["is_success", "is_terminated", "is_truncated"]].tolist() == [True, True, False]
    assert last.loc[("boxes-0", 1), ["is_success", "is_terminated", "is_truncated"]].tolist() == [False, True, False]
    assert steps.is_success.sum() == 3
    assert (steps.is_terminated | steps.is_truncated).sum() == 6


def test_a_stopped_recording_goes_on_where_it_was_and_is_equal(episodes, tmp_path):
    record(episodes, tmp_path / "whole")
    record(episodes, tmp_path / "stopped", stop_after=2)
    assert not (tmp_path / "stopped" / "steps.parquet").exists()
    assert len(record(episodes, tmp_path / "stopped").kept) == 2
    assert files(tmp_path / "stopped") == files(tmp_path / "whole")


def test_a_finished_recording_is_left_alone_and_one_with_more_episodes_made_again(episodes, tmp_path):
    few = episodes.chosen(count=2)
    record(few, tmp_path / "out")
    assert not hasattr(record(few, tmp_path / "out"), "kept")
    record(episodes, tmp_path / "out")
    record(episodes, tmp_path / "whole")
    assert files(tmp_path / "out") == files(tmp_path / "whole")


def test_a_recording_with_other_settings_is_not_overwritten(episodes, tmp_path):
    record(episodes.chosen(count=1), tmp_path)
    before = files(tmp_path)
    with pytest.raises(InvalidValueError, match="point_clouds was False, is True"):
        record(episodes.chosen(count=1), tmp_path, point_clouds=True)
    assert files(tmp_path) == before
