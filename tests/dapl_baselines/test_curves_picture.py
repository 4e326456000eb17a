import io
from pathlib import Path

import pytest
from PIL import Image

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, MissingFileError
from dapl_baselines.cli import PROGRAM
from dapl_baselines.curves_picture import draw_curves, read_looks

HEADER = "iteration,environment_steps,episodes,success_rate,mean_offset_cm,timing_seconds\n"


def write_curve(folder: Path, *rows: str) -> Path:
    folder.mkdir()
    (folder / "validation.csv").write_text(HEADER + "".join(f"{row}\n" for row in rows))
    return folder


def test_looks_are_read_with_their_time_and_steps(tmp_path):
    first, second = read_looks(write_curve(tmp_path / "a", "5,1000,64,0.25,1.5,1800", "10,2000,64,0.5,1.5,3600"))
    assert (first.hours, first.steps, first.success_rate, first.episodes) == (0.5, 1000, 0.25, 64)
    assert second.hours == 1
    low, high = second.interval
    assert 0.37 < low < 0.39 < 0.61 < high < 0.63


@pytest.mark.parametrize("row", ["5,1000,64", "5,x,64,0.25,1.5,1800"])
def test_a_damaged_curve_is_refused_in_one_line(tmp_path, row):
    with pytest.raises(InvalidFileError, match="not a validation curve") as caught:
        read_looks(write_curve(tmp_path / "a", row))
    assert "\n" not in str(caught.value)


def test_a_training_without_a_look_is_refused(tmp_path):
    with pytest.raises(InvalidFileError, match="holds no look at the validation scenes yet"):
        read_looks(write_curve(tmp_path / "a"))
    with pytest.raises(MissingFileError):
        read_looks(tmp_path / "nowhere")


def test_the_picture_is_the_same_each_time(tmp_path):
    looks = read_looks(write_curve(tmp_path / "a", "5,1000,64,0.25,1.5,1800", "10,2000,64,0.5,1.5,3600"))
    drawn = draw_curves({"a": looks})
    assert drawn == draw_curves({"a": looks})
    assert Image.open(io.BytesIO(drawn)).size == (1350, 540)


def test_the_command_draws_several_trainings(tmp_path, capsys):
    folders = [write_curve(tmp_path / name, "5,1000,64,0.25,1.5,1800") for name in ("teacher", "student")]
    runs = [part for folder in folders for part in ("--run", str(folder))]
    assert run(["show-curves", *runs, "--out", str(tmp_path / "x.png")], PROGRAM) == 0
    assert "best looks: teacher 25.0%, student 25.0%" in " ".join(capsys.readouterr().out.split())
    assert (tmp_path / "x.png").is_file()


def test_the_command_refuses_what_is_no_training(tmp_path, capsys):
    assert run(["show-curves", "--run", str(tmp_path)], PROGRAM) == 2
    assert "validation.csv" in capsys.readouterr().err
