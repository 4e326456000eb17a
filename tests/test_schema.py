"""Files at the edge: written whole or not at all, read with suspicion."""

import io
import resource
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d import schema
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError, StorageError
from clutter6d.schema import (
    ArraySpec,
    FileModel,
    canonical_json,
    read_arrays,
    read_bytes,
    read_model,
    write_arrays,
    write_bytes,
    write_model,
)


class Cup(FileModel):
    schema_version: Literal[1] = 1
    name: str
    height_m: float = 0.1
    sizes: tuple[int, ...] = ()


POINTS = {"points": ArraySpec(dtype="float32", shape=(None, 3))}


@pytest.fixture
def _files_of_at_most_64_kib() -> Iterator[None]:
    """The system refuses to let a file grow further, as a full disk does."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    signal.signal(signal.SIGXFSZ, handler)


@given(st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=20))
def test_a_model_comes_back_to_the_bit(tmp_path_factory: pytest.TempPathFactory, height: float, name: str) -> None:
    path = tmp_path_factory.getbasetemp() / "cup.json"
    cup = Cup(name=name, height_m=height)
    write_model(path, cup)
    returned = read_model(path, Cup, what="cup")
    assert returned == cup
    assert np.float64(returned.height_m).tobytes() == np.float64(height).tobytes()


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ('{"name": "a", "colour": "red"}', "colour: Extra inputs are not permitted"),
        ('{"name": 3}', "name: Input should be a valid string"),
        ("{}", "name: Field required"),
        ('{"name": "a", "schema_version": 2}', "schema_version: Input should be 1"),
        ('{"name": "a", "sizes": [1, 2, "x"]}', "sizes.2: "),
        ('{"name": "a", "height_m": NaN}', "height_m: Input should be a finite number"),
        ('{"name": "a", "height_m": 1e999}', "height_m: Input should be a finite number"),
        ('{"name": "a"', "(whole file): Invalid JSON"),
        ("", "(whole file): Invalid JSON"),
        ("[" * 100_000, "(whole file): Invalid JSON"),
        ("[1]", "(whole file): "),
    ],
)
def test_a_bad_file_is_refused_with_the_field_in_one_line(tmp_path: Path, content: str, problem: str) -> None:
    path = tmp_path / "cup.json"
    path.write_text(content)
    with pytest.raises(InvalidFileError) as caught:
        read_model(path, Cup, what="cup")
    assert str(caught.value).startswith(f"{path}: not a valid cup: {problem}")
    assert "\n" not in str(caught.value)


def test_bytes_that_are_not_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "cup.json"
    path.write_bytes(b"\xff\xfe\x00{")
    with pytest.raises(InvalidFileError, match="not a valid cup"):
        read_model(path, Cup, what="cup")


def test_a_missing_file_a_folder_and_a_huge_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match="cup not found"):
        read_bytes(tmp_path / "none.json", what="cup")
    with pytest.raises(InvalidFileError, match="cannot be read: Is a directory"):
        read_bytes(tmp_path, what="cup")
    (tmp_path / "large").write_bytes(bytes(101))
    with pytest.raises(InvalidFileError, match="101 bytes are more than the 100 allowed for a cup"):
        read_bytes(tmp_path / "large", what="cup", max_bytes=100)


def test_a_model_is_immutable() -> None:
    with pytest.raises(ValueError, match="frozen"):
        Cup(name="a").name = "b"  # pyright: ignore[reportAttributeAccessIssue]


@pytest.mark.usefixtures("_files_of_at_most_64_kib")
def test_a_full_disk_is_one_line_and_leaves_the_earlier_file_whole(tmp_path: Path) -> None:
    path = tmp_path / "results.bin"
    write_bytes(path, b"earlier")
    with pytest.raises(StorageError, match=r"cannot write .*; nothing earlier was changed"):
        write_bytes(path, bytes(1 << 17))
    assert path.read_bytes() == b"earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_where_a_file_stands_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(InvalidValueError, match="out is in the way"):
        write_bytes(tmp_path / "out" / "scene.json", b"{}")
    with pytest.raises(InvalidValueError, match="the folder .* is in the way"):
        write_bytes(tmp_path, b"{}")


def test_missing_folders_are_made(tmp_path: Path) -> None:
    write_bytes(tmp_path / "a" / "b" / "c.bin", b"x")
    assert (tmp_path / "a" / "b" / "c.bin").read_bytes() == b"x"


def test_a_write_that_is_killed_leaves_the_old_content_or_the_new(tmp_path: Path) -> None:
    path = tmp_path / "results.bin"
    script = (
        "import sys; from pathlib import Path; from clutter6d.schema import write_bytes\n"
        "path, turn = Path(sys.argv[1]), 0\n"
        "while True:\n"
        "    write_bytes(path, bytes([turn % 256]) * 4_000_000); turn += 1; print(turn, flush=True)\n"
    )
    for delay_s in (0.002, 0.005, 0.011):
        writer = subprocess.Popen([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE)
        assert writer.stdout is not None
        writer.stdout.readline()
        time.sleep(delay_s)
        writer.kill()
        writer.communicate()
        content = path.read_bytes()
        assert len(content) == 4_000_000
        assert content.count(content[:1]) == len(content)


def test_a_write_interrupted_by_the_user_leaves_nothing_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "results.bin"
    write_bytes(path, b"earlier")

    def interrupt(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(schema.os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_bytes(path, b"later")
    assert path.read_bytes() == b"earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_arrays_come_back_to_the_bit_and_equal_arrays_give_equal_files(tmp_path: Path) -> None:
    points = np.linspace(-1, 1, 30, dtype=np.float32).reshape(10, 3)
    write_arrays(tmp_path / "a.npz", {"points": points})
    write_arrays(tmp_path / "b.npz", {"points": points.copy()})
    returned = read_arrays(tmp_path / "a.npz", POINTS, what="points")
    np.testing.assert_array_equal(returned["points"], points)
    assert returned["points"].dtype == np.float32
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def _npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


def _pickled() -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, points=np.array([{"run": "me"}], dtype=object), allow_pickle=True)
    with zipfile.ZipFile(buffer) as archive:
        content = archive.read("points.npy")
    single = io.BytesIO()
    with zipfile.ZipFile(single, "w") as archive:
        archive.writestr("points.npy", content)
    return single.getvalue()


def _lying_header() -> bytes:
    """An archive of a few bytes whose array claims to hold 10^12 rows."""
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000000000, 3), }"
    header += b" " * (63 - (10 + len(header)) % 64) + b"\n"
    content = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(12)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("points.npy", content)
    return buffer.getvalue()


GOOD = np.zeros((4, 3), np.float32)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "not a valid points"),
        (b"PK\x03\x04 and then nothing", "not a valid points"),
        (_npz(points=GOOD)[:-30], "not a valid points"),
        (_npz(points=GOOD).replace(b"points", b"p\xffints"), "not a valid points|holds arrays"),
        (_pickled(), "allow_pickle=False"),
        (_lying_header(), "not a valid points"),
        (_npz(points=GOOD, more=GOOD), r"holds arrays \['more', 'points'\], expected \['points'\]"),
        (_npz(), r"holds arrays \[\], expected"),
        (_npz(points=GOOD.astype(np.float64)), "array 'points' is float64"),
        (_npz(points=GOOD[:, :2]), r"array 'points' is float32\(4, 2\), expected float32\(None, 3\)"),
        (_npz(points=GOOD[0]), "array 'points' is float32"),
        (_npz(points=np.full((4, 3), np.nan, np.float32)), "not finite"),
        (_npz(points=np.full((4, 3), np.inf, np.float32)), "not finite"),
    ],
    # Not the content: archives hold the time, and each process of a parallel run makes its own.
    ids=[
        *("empty", "noise", "cut", "renamed", "pickled", "lying", "more", "none", "float64", "two columns", "one row"),
        *("nan", "infinite"),
    ],
)
def test_a_bad_archive_is_refused_in_one_line(tmp_path: Path, content: bytes, problem: str) -> None:
    path = tmp_path / "points.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidFileError, match=problem) as caught:
        read_arrays(path, POINTS, what="points")
    assert "\n" not in str(caught.value)


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(schema, "MAX_ARRAYS_BYTES", 1 << 20)
    path = tmp_path / "points.npz"
    path.write_bytes(_npz(points=np.zeros((1 << 18, 3), np.float32)))
    assert path.stat().st_size < 1 << 14
    with pytest.raises(InvalidFileError, match="unpacks to more than 1,048,576 bytes"):
        read_arrays(path, POINTS, what="points")


def test_canonical_json_does_not_depend_on_the_order_of_keys() -> None:
    assert canonical_json({"b": [1, 0.1], "a": None}) == b'{"a":null,"b":[1,0.1]}'
    assert canonical_json({"a": 1, "b": 2}) == canonical_json({"b": 2, "a": 1})
    with pytest.raises(ValueError, match="JSON compliant"):
        canonical_json(float("nan"))
