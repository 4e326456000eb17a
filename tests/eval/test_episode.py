import json

import numpy as np
import pytest

from clutter6d.errors import InvalidFileError
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow, actions_sha256, episode_path, read_episode, write_episode
from clutter6d.seeding import generator


@pytest.fixture
def record() -> EpisodeRecord:
    actions = generator(0, "actions").normal(size=(5, 7)).astype(np.float32)
    row = EpisodeRow(
        scene_id="s-0.1",
        pair=3,
        track="sparse",
        outcome="timeout",
        steps=5,
        is_success=False,
        is_planar_success=True,
        is_symmetric_success=False,
        holds=False,
        position_error_m=0.1 + 0.2,
        planar_error_m=0.1,
        rotation_error_rad=1 / 3,
        symmetric_rotation_error_rad=0.1,
        mean_offset_cm=2.0,
        actions_sha256=actions_sha256(actions),
        final_state_sha256="0" * 64,
        timing_seconds=1.5,
    )
    return EpisodeRecord(row=row, actions=actions)


def test_an_episode_comes_back_from_its_file_to_the_bit(tmp_path, record):
    write_episode(tmp_path, record)
    back = read_episode(episode_path(tmp_path, "s-0.1", 3))
    assert back.row == record.row
    assert np.array_equal(back.actions, record.actions)


def test_timing_is_no_difference(record):
    slower = record.row.model_copy(update={"timing_seconds": 9.0})
    assert record.row.differences(slower) == ()
    assert record.row.differences(record.row.model_copy(update={"steps": 4, "holds": True})) == ("steps", "holds")


@pytest.mark.parametrize(
    "change",
    [
        lambda content: content["row"].update(steps=4),
        lambda content: content["row"].update(actions_sha256="1" * 64),
        lambda content: content["row"].update(unknown=1),
        lambda content: content["row"].update(mean_offset_cm=None),
        lambda content: content.update(actions_base64="!!"),
        lambda content: content.update(actions_base64=content["actions_base64"][:-8]),
        lambda content: content.update(actions_base64=""),
        lambda content: content.update(schema_version=2),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(tmp_path, record, change):
    write_episode(tmp_path, record)
    path = episode_path(tmp_path, "s-0.1", 3)
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))
    with pytest.raises(InvalidFileError) as caught:
        read_episode(path)
    assert "\n" not in str(caught.value)
