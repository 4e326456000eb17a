"""Contact sheets and videos."""

import subprocess
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence

from clutter6d.errors import InvalidValueError, StorageError
from clutter6d.render.sheet import contact_sheet, write_image
from clutter6d.render.video import write_video


def plain(value: int, size: tuple[int, int] = (40, 60)) -> np.ndarray:
    return np.full((*size, 3), value, dtype=np.uint8)


def test_contact_sheet_shows_every_picture_and_label():
    sheet = contact_sheet([plain(10 + 40 * i) for i in range(5)], [f"number {i}" for i in range(5)], columns=3)
    pixels = np.array(sheet)
    assert pixels.shape[1] > 3 * 60
    assert pixels.shape[0] > 2 * 40
    for i in range(5):
        assert (pixels == 10 + 40 * i).all(axis=-1).sum() >= 40 * 60
    assert (pixels.sum(axis=-1) < 300).sum() > 0, "labels are written in dark ink"


def test_contact_sheet_with_fewer_pictures_than_columns_is_narrow():
    assert contact_sheet([plain(0)], ["a very long label that does not fit"], columns=8).width < 80


@pytest.mark.parametrize(
    ("images", "labels", "columns"),
    [([], [], 3), ([plain(1)], [], 3), ([plain(1), plain(1, (2, 2))], ["a", "b"], 3), ([plain(1)], ["a"], 0)],
)
def test_contact_sheet_refuses_what_cannot_be_laid_out(images, labels, columns):
    with pytest.raises(InvalidValueError, match="contact sheet"):
        contact_sheet(images, labels, columns)


def test_images_survive_writing(tmp_path):
    image = np.random.default_rng(0).integers(0, 255, (12, 20, 3), dtype=np.uint8)
    write_image(tmp_path / "new" / "picture.png", image)
    with Image.open(tmp_path / "new" / "picture.png") as picture:
        assert np.array_equal(np.array(picture), image)


def read_mp4(path: Path, height: int = 32, width: int = 64) -> list[np.ndarray]:
    output = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path), *output]
    decoded = subprocess.run(command, capture_output=True, check=True).stdout
    return list(np.frombuffer(decoded, np.uint8).reshape(-1, height, width, 3))


def read_gif(path: Path) -> list[np.ndarray]:
    with Image.open(path) as file:
        return [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(file)]


@pytest.mark.parametrize("ending", [".mp4", ".gif"])
def test_a_video_has_all_frames_in_order(tmp_path, ending):
    path = tmp_path / f"episode{ending}"
    write_video((plain(30 * i, (33, 65)) for i in range(8)), path, fps=10)
    frames = read_mp4(path) if ending == ".mp4" else read_gif(path)
    brightness = [frame[..., :3].mean() for frame in frames]
    assert len(brightness) == 8
    assert brightness == sorted(brightness)
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


def test_a_failing_video_leaves_the_earlier_one(tmp_path):
    path = tmp_path / "episode.gif"
    write_video([plain(1), plain(2)], path, fps=10)
    before = path.read_bytes()
    with pytest.raises(InvalidValueError, match="no frames"):
        write_video([], path, fps=10)
    assert path.read_bytes() == before
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


def test_a_video_with_a_wrong_ending_or_rate_or_place_is_refused(tmp_path):
    with pytest.raises(InvalidValueError, match=r"\.mp4 or \.gif"):
        write_video([plain(1)], tmp_path / "episode.avi", fps=10)
    with pytest.raises(InvalidValueError, match="rate"):
        write_video([plain(1)], tmp_path / "episode.gif", fps=0)
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError):
        write_video([plain(1)], tmp_path / "file" / "episode.gif", fps=10)
