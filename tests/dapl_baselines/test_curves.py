import pytest

from clutter6d.errors import InvalidFileError
from dapl_baselines.curves import Curves


def add(folder, last, numbers):
    curves = Curves(folder, last)
    for number in numbers:
        curves.add("training", number, {"loss": number / 8})
    curves.close()


def test_a_continued_curve_is_that_of_an_unbroken_run(tmp_path):
    add(tmp_path / "unbroken", 0, range(1, 7))
    add(tmp_path / "broken", 0, range(1, 5))
    add(tmp_path / "broken", 2, range(3, 7))
    text = (tmp_path / "unbroken" / "training.csv").read_text()
    assert (tmp_path / "broken" / "training.csv").read_text() == text
    assert text.splitlines()[:2] == ["iteration,loss", "1,0.125"]


def test_a_row_that_a_kill_cut_is_written_again(tmp_path):
    add(tmp_path, 0, range(1, 4))
    path = tmp_path / "training.csv"
    path.write_text(path.read_text()[:-3])
    add(tmp_path, 3, [4])
    assert [line.split(",")[0] for line in path.read_text().splitlines()] == ["iteration", "1", "2", "4"]


def test_tensorboard_has_the_same_points(tmp_path):
    add(tmp_path, 0, range(1, 4))
    assert list((tmp_path / "tensorboard").iterdir())


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "", "iteration,loss\nnone,0.5\n"])
def test_another_table_in_its_place_is_not_overwritten(tmp_path, text):
    (tmp_path / "training.csv").write_text(text)
    with pytest.raises(InvalidFileError, match="not a curve of this training"):
        add(tmp_path, 0, [1])
    assert (tmp_path / "training.csv").read_text() == text
