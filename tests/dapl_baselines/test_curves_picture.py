import io
from pathlib import Path

import pytest
from PIL import Image

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, MissingFileError
from dapl_baselines.cli import PROGRAM
from dapl_baselines.curves_picture import draw_curves, read_course

HEADER = "iteration,environment_steps,episodes,success_rate,mean_offset_cm,timing_seconds\n"


PRACTICE = ("1,500,3,0.0,1.5,900", "2,1000,0,nan,1.5,1800", "3,1500,1,1.0,1.5,2700")


def write_curve(folder: Path, *rows: str, practice: tuple[str, ...] = PRACTICE) -> Path:
    folder.mkdir()
    for name, lines in (("validation", rows), ("training", practice)):
        (folder / f"{name}.csv").write_text(HEADER + "".join(f"{line}\n" for line in lines))
    return folder


def test_looks_are_read_with_their_time_and_steps(tmp_path):
    course = read_course(write_curve(tmp_path / "a", "5,1000,64,0.25,1.5,1800", "10,2000,64,0.5,1.5,3600"))
    first, second = course.looks
    assert (first.hours, first.steps, first.success_rate, first.episodes) == (0.5, 1000, 0.25, 64)
    assert second.hours == 1
    low, high = second.interval
    assert 0.37 < low < 0.39 < 0.61 < high < 0.63


def test_practice_is_joined_over_iterations_by_episodes(tmp_path):
    practice = tuple(f"{number},{100 * number},2,{number % 2},1.5,{36 * number}" for number in range(1, 101))
    course = read_course(write_curve(tmp_path / "a", "5,1000,64,0.25,1.5,1800", practice=practice))
    assert [look.episodes for look in course.practice] == [10] * 20
    assert [look.success_rate for look in course.practice[:2]] == [0.6, 0.4]
    assert (course.practice[-1].hours, course.practice[-1].steps) == (1, 10_000)
    few = read_course(write_curve(tmp_path / "b", "5,1000,64,0.25,1.5,1800"))
    assert few.practice == ()


@pytest.mark.parametrize("row", ["5,1000,64", "5,x,64,0.25,1.5,1800"])
def test_a_damaged_curve_is_refused_in_one_line(tmp_path, row):
    with pytest.raises(InvalidFileError, match="not a learning curve") as caught:
        read_course(write_curve(tmp_path / "a", row))
    assert "\n" not in str(caught.value)


def test_a_training_without_a_look_is_refused(tmp_path):
    with pytest.raises(InvalidFileError, match="holds no look at the validation scenes yet"):
        read_course(write_curve(tmp_path / "a"))
    with pytest.raises(MissingFileError):
        read_course(tmp_path / "nowhere")


def test_the_picture_is_the_same_each_time(tmp_path):
    course = read_course(write_curve(tmp_path / "a", "5,1000,64,0.25,1.5,1800", "10,2000,64,0.5,1.5,3600"))
    drawn = draw_curves({"a": course})
    assert drawn == draw_curves({"a": course})
    assert Image.open(io.BytesIO(drawn)).size == (1500, 510)


def test_the_command_draws_several_trainings(tmp_path, capsys):
    folders = [write_curve(tmp_path / name, "5,1000,64,0.25,1.5,1800") for name in ("teacher", "student")]
    runs = [part for folder in folders for part in ("--run", str(folder))]
    assert run(["show-curves", *runs, "--out", str(tmp_path / "x.png")], PROGRAM) == 0
    assert "best looks: teacher 25.0%, student 25.0%" in " ".join(capsys.readouterr().out.split())
    assert (tmp_path / "x.png").is_file()


def test_the_command_refuses_what_is_no_training(tmp_path, capsys):
    assert run(["show-curves", "--run", str(tmp_path)], PROGRAM) == 2
    assert "validation.csv" in capsys.readouterr().err
