import numpy as np
import pytest

from clutter6d.errors import InvalidFileError, StorageError
from dapl_baselines.teleop.draft import Draft, draft_path


def row(value: float) -> np.ndarray:
    return np.full(7, value, dtype=np.float32)


@pytest.fixture
def path(tmp_path):
    return draft_path(tmp_path, "boxes-0", 3)


def test_actions_are_on_disk_as_soon_as_they_are_decided(path):
    draft = Draft(path, 10)
    for value in (0.1, 0.2):
        draft.append(row(value))
    again = Draft(path, 10)
    assert len(again) == 2
    np.testing.assert_array_equal(again[1], row(0.2))


def test_half_a_row_that_a_kill_left_is_written_over(path):
    Draft(path, 10).append(row(0.1))
    path.write_bytes(path.read_bytes() + b"\x01\x02\x03")
    draft = Draft(path, 10)
    assert len(draft) == 1
    draft.append(row(0.2))
    assert [float(Draft(path, 10)[step][0]) for step in range(2)] == pytest.approx([0.1, 0.2])


def test_an_attempt_that_is_given_up_stands_still_to_its_end(path):
    draft = Draft(path, 5)
    draft.append(row(0.1))
    draft.fill()
    again = Draft(path, 5)
    assert len(again) == 5
    assert not any(again[step].any() for step in range(1, 5))


def test_nothing_stays_of_a_draft_that_is_removed(path, tmp_path):
    draft = Draft(path, 5)
    draft.append(row(0.1))
    draft.remove()
    assert list(tmp_path.iterdir()) == []
    draft.remove()


@pytest.mark.parametrize(
    "content", [np.full(7, np.nan, "<f4").tobytes(), bytes(28 * 6), bytes(1 << 20)], ids=["nan", "long", "huge"]
)
def test_what_is_no_draft_is_refused_by_name(path, content):
    path.parent.mkdir()
    path.write_bytes(content)
    with pytest.raises(InvalidFileError, match="boxes-0@0003.f32"):
        Draft(path, 5)


def test_a_folder_that_cannot_be_written_is_named(path):
    path.parent.write_text("in the way")
    with pytest.raises(StorageError, match="cannot write"):
        Draft(path, 5).append(row(0.1))
