import numpy as np
import pytest
import torch

from clutter6d.errors import InvalidFileError
from dapl_baselines.replay import Replay


def batch(*numbers: float) -> dict[str, torch.Tensor]:
    values = torch.tensor(numbers, dtype=torch.float32)[:, None]
    return {"state": values.repeat(1, 2), "stored": values.half()}


def test_the_newest_rows_take_the_place_of_the_oldest(tmp_path):
    replay = Replay(tmp_path, batch(0), 5)
    for first in (0, 3, 6):
        replay.add(batch(first, first + 1, first + 2))
    assert (replay.fields, replay.count) == (("state", "stored"), 9)
    rows = replay.take(np.arange(4, 9), replay.fields)
    assert rows["state"][:, 0].tolist() == [4, 5, 6, 7, 8]
    assert torch.equal(rows["state"][:, :1], rows["stored"].float())


def test_rows_outlive_the_process_and_are_made_again_in_their_places(tmp_path):
    Replay(tmp_path, batch(0), 4).add(batch(1, 2, 3))
    again = Replay(tmp_path, batch(0), 4)
    again.count = 2
    again.add(batch(7))
    assert again.take(np.arange(3), ["state"])["state"][:, 0].tolist() == [1, 2, 7]


def test_the_oldest_row_is_the_first_that_has_not_been_replaced(tmp_path):
    replay = Replay(tmp_path, batch(0), 5)
    assert replay.oldest == 0
    replay.add(batch(0, 1, 2, 3, 4))
    assert replay.oldest == 0
    replay.add(batch(5, 6))
    assert (replay.oldest, replay.oldest_of(9), replay.oldest_of(3)) == (2, 4, 0)
    assert replay.take(np.array([replay.oldest]), ["state"])["state"][0, 0] == 2


def test_one_field_of_rows_can_be_changed(tmp_path):
    replay = Replay(tmp_path, batch(0), 5)
    for first in (0, 3):
        replay.add(batch(first, first + 1, first + 2))
    replay.put("stored", np.array([1, 5]), np.full((2, 1), 9.0))
    rows = replay.take(np.arange(1, 6), replay.fields)
    assert rows["stored"][:, 0].tolist() == [9, 2, 3, 4, 9]
    assert rows["state"][:, 0].tolist() == [1, 2, 3, 4, 5]
    assert Replay(tmp_path, batch(0), 5).take(np.array([5]), ["stored"])["stored"].tolist() == [[9]]


@pytest.mark.parametrize("content", [b"", b"no rows", None])
def test_files_of_something_else_are_refused(tmp_path, content):
    if content is None:
        Replay(tmp_path, batch(0), 4)
    else:
        (tmp_path / "state.npy").write_bytes(content)
    with pytest.raises(InvalidFileError, match=r"state\.npy"):
        Replay(tmp_path, batch(0), 5)
