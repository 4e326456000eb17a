from typing import Literal

import pytest

from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.schema import FileModel
from dapl_baselines.run_folder import claim


class Part(FileModel):
    rows: int = 4
    rate: float | None = None


class Record(FileModel):
    schema_version: Literal[1] = 1
    seed: int = 0
    part: Part | None = Part()


def take(folder, record, **options):
    claim(folder / "run.json", record, what="training", **options)


def test_a_new_folder_is_taken_and_found_again(tmp_path):
    for _ in range(2):
        take(tmp_path / "deep" / "run", Record())
    assert (tmp_path / "deep" / "run" / "run.json").is_file()


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (Record(seed=1), "seed was 0, is 1"),
        (Record(part=Part(rows=5)), r"part\.rows was 4, is 5"),
        (Record(part=Part(rate=0.5)), r"part\.rate was None, is 0\.5"),
        (Record(part=None), r"part\.rows was 4, is None"),
    ],
)
def test_other_settings_are_named(tmp_path, record, said):
    take(tmp_path, Record())
    before = (tmp_path / "run.json").read_bytes()
    with pytest.raises(InvalidValueError, match=said):
        take(tmp_path, record)
    assert (tmp_path / "run.json").read_bytes() == before


def test_what_may_change_is_written_anew(tmp_path):
    take(tmp_path, Record())
    take(tmp_path, Record(part=Part(rows=9)), may_change={"part.rows"})
    take(tmp_path, Record(part=Part(rows=9)))


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InvalidValueError, match="neither an empty folder nor a training"):
        take(tmp_path, Record())
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_damaged_record_is_refused(tmp_path):
    (tmp_path / "run.json").write_text('{"seed": "x"}')
    with pytest.raises(InvalidFileError, match="seed"):
        take(tmp_path, Record())
