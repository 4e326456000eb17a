"""Videos: frames to an MP4 or GIF file."""

import contextlib
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
from jaxtyping import UInt8
from PIL import Image

from clutter6d.errors import InvalidValueError, StorageError

Frame = UInt8[np.ndarray, "_ _ 3"]
FORMATS = (".mp4", ".gif")


def write_video(frames: Iterable[Frame], path: Path, fps: int) -> None:
    """Write frames as a video that replaces the file only when it is complete.

    Args:
        frames: Pictures of one size; drawn one at a time.
        path: Ends in ``.mp4`` (H.264; odd sizes lose one row or column) or ``.gif``.
        fps: Frames per second.

    Raises:
        InvalidValueError: No frames, another ending, or a rate that is not positive.
        StorageError: It cannot be written.
    """
    ending = path.suffix.lower()
    if ending not in FORMATS or not 0 < fps <= 240:
        raise InvalidValueError(f"video {path} at {fps} frames/s: use the ending .mp4 or .gif and a rate in (0, 240]")
    partial = path.with_name(f".{path.stem}.partial{ending}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        (_write_mp4 if ending == ".mp4" else _write_gif)(iter(frames), partial, fps)
        partial.replace(path)
    except StopIteration:
        raise InvalidValueError(f"video {path}: there are no frames") from None
    except OSError as error:
        raise StorageError(f"{path}: video cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def _write_mp4(frames: Iterator[Frame], path: Path, fps: int) -> None:
    first = _even(next(frames))
    height, width, _ = first.shape
    options: dict[str, Any] = {"codec": "libx264", "macro_block_size": 1, "output_params": ["-crf", "20"]}
    writer: Any = imageio_ffmpeg.write_frames(str(path), (width, height), fps=fps, ffmpeg_log_level="error", **options)
    writer.send(None)
    try:
        for frame in chain([first], map(_even, frames)):
            writer.send(np.ascontiguousarray(frame))
    finally:
        writer.close()


def _write_gif(frames: Iterator[Frame], path: Path, fps: int) -> None:
    pictures = map(Image.fromarray, frames)
    next(pictures).save(path, save_all=True, append_images=pictures, duration=1000 / fps, loop=0)


def _even(frame: Frame) -> Frame:
    """H.264 in its usual colour format needs even sizes."""
    return frame[: frame.shape[0] // 2 * 2, : frame.shape[1] // 2 * 2]
