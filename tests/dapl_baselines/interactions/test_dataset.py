"""Transitions: all of them, each once, parted by scene."""

import shutil

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.schema import write_model
from dapl_baselines.interactions.dataset import open_interactions
from dapl_baselines.interactions.recording import Recording
from dapl_baselines.interactions.shards import RECORDING_FILE, open_recording
from dapl_baselines.interactions.states import unpack_states
from tests.dapl_baselines.interactions.pushed_boxes import make_header


def test_every_step_of_every_episode_is_a_transition_of_its_side(pushed_boxes):
    data = open_interactions([pushed_boxes])
    assert (len(data.training), len(data.validation)) == (80, 40)
    _, (shard,) = open_recording(pushed_boxes / "sweep")
    (held_out,) = [entry for entry in shard.episodes if entry.scene_id == "boxes-2"]
    assert data.validation.row.tolist() == list(range(held_out.first_row, held_out.first_row + 40))
    now, later = data.states(data.validation)
    rows = unpack_states(shard.states[held_out.rows])
    np.testing.assert_array_equal(now.object_poses, rows.object_poses[:-1])
    np.testing.assert_array_equal(later.object_poses, rows.object_poses[1:])


def test_a_recording_may_be_given_itself_and_counts_once(pushed_boxes):
    both = open_interactions([pushed_boxes, pushed_boxes / "sweep"])
    assert len(both.training) == 80
    assert both.sha256 == open_interactions([pushed_boxes]).sha256


def test_recordings_of_the_same_scenes_share_them(pushed_boxes, tmp_path):
    for name in ("once", "twice"):
        shutil.copytree(pushed_boxes / "sweep", tmp_path / name)
    data = open_interactions([tmp_path])
    assert len(data.training) == 160
    assert set(data.training.scene) | set(data.validation.scene) == {0, 1, 2}


def test_a_folder_without_recordings_is_one_line(tmp_path):
    with pytest.raises(MissingFileError, match="make one with: dapl record"):
        open_interactions([tmp_path])


def test_a_recording_without_episodes_is_one_line(tmp_path):
    Recording(tmp_path / "empty", make_header())
    with pytest.raises(InvalidValueError, match="no episode is recorded yet"):
        open_interactions([tmp_path])


@pytest.mark.parametrize(
    ("held_out", "what"), [(["elsewhere"], "hold out"), (["boxes-0", "boxes-1", "boxes-2"], "train on")]
)
def test_both_sides_need_transitions(pushed_boxes, tmp_path, held_out, what):
    shutil.copytree(pushed_boxes / "sweep", tmp_path / "one-sided")
    write_model(tmp_path / "one-sided" / RECORDING_FILE, make_header(validation_scenes=tuple(held_out)))
    with pytest.raises(InvalidValueError, match=f"none to {what}"):
        open_interactions([tmp_path])
