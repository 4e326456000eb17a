"""Videos: frames to an MP4 or GIF file, and MP4 files one after another into one."""

import contextlib
import subprocess
from collections.abc import Iterable, Iterator, Sequence
from functools import partial as bind
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


def write_video(frames: Iterable[Frame], path: Path, fps: int, *, keyframe_every: int | None = None) -> None:
    """Write frames as a video that replaces the file only when it is complete.

    Args:
        frames: Pictures of one size; drawn one at a time.
        path: Ends in ``.mp4`` (H.264; odd sizes lose one row or column) or ``.gif``.
        fps: Frames per second.
        keyframe_every: For an MP4 whose frames are looked up in any order, or that is to be joined with others: every
            so many frames one that stands alone, and none that needs a later one. By default as small as can be.

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
        write = bind(_write_mp4, keyframe_every=keyframe_every) if ending == ".mp4" else _write_gif
        write(iter(frames), partial, fps)
        partial.replace(path)
    except StopIteration:
        raise InvalidValueError(f"video {path}: there are no frames") from None
    except OSError as error:
        raise StorageError(f"{path}: video cannot be written: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(OSError):
            partial.unlink()


def join_videos(paths: Sequence[Path], out: Path) -> None:
    """Join MP4 files of one size and rate, in order and without encoding them again.

    Args:
        paths: Files that :func:`write_video` wrote with ``keyframe_every``.
        out: Replaced when it is complete.

    Raises:
        StorageError: It cannot be written, or a file cannot be read.
    """
    listing, partial = out.with_name(f".{out.stem}.txt"), out.with_name(f".{out.stem}.partial.mp4")
    quoted = [str(path.resolve()).replace("'", "'\\''") for path in paths]
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-y", "-f", "concat", "-safe", "0", "-i", str(listing)]
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        listing.write_text("".join(f"file '{path}'\n" for path in quoted))
        copied = [*command, "-c", "copy", "-movflags", "+faststart", str(partial)]
        subprocess.run(copied, check=True, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        partial.replace(out)
    except subprocess.CalledProcessError as error:
        raise StorageError(f"{out}: videos cannot be joined: {' '.join(str(error.stderr).split())[-200:]}") from None
    except OSError as error:
        raise StorageError(f"{out}: video cannot be written: {error.strerror or error}") from error
    finally:
        for path in (listing, partial):
            with contextlib.suppress(OSError):
                path.unlink()


def _write_mp4(frames: Iterator[Frame], path: Path, fps: int, *, keyframe_every: int | None) -> None:
    first = _even(next(frames))
    height, width, _ = first.shape
    standing_alone = ["-g", str(keyframe_every), "-bf", "0"] if keyframe_every else []
    options: dict[str, Any] = {"codec": "libx264", "macro_block_size": 1}
    options["output_params"] = ["-crf", "20", *standing_alone]
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
