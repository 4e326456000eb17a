"""The journal of a library's reviews: one line a decision, only ever appended to, on disk before it is acknowledged.

A line counts once it ends in a line break. What a power cut left of a line was never acknowledged: it is ignored, and
cut off when the next line is written.
"""

import fcntl
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from clutter6d.assets.review.entry import ReviewEntry
from clutter6d.errors import InvalidFileError, StorageError
from clutter6d.schema import read_bytes

JOURNAL_NAME = "reviews.jsonl"
MAX_JOURNAL_BYTES = 256 << 20

_log = logging.getLogger(__name__)


class ReviewJournal:
    """The decisions on the assets of one library.

    Attributes:
        path: The file; it need not be there yet.
    """

    def __init__(self, library: Path) -> None:
        self.path = library / JOURNAL_NAME

    def entries(self) -> tuple[ReviewEntry, ...]:
        """Every decision, in the order in which they were made.

        Raises:
            InvalidFileError: A line other than an unfinished last one is no decision.
        """
        if not self.path.exists():
            return ()
        content = read_bytes(self.path, what="review journal", max_bytes=MAX_JOURNAL_BYTES)
        *lines, unfinished = content.split(b"\n")
        if unfinished:
            _log.warning("%s: ignored an unfinished last line of %d bytes", self.path, len(unfinished))
        return tuple(self._parse(number, line) for number, line in enumerate(lines, start=1))

    def version(self) -> tuple[int, int]:
        """Changes whenever the journal does: the file's number and its size."""
        try:
            found = self.path.stat()
        except FileNotFoundError:
            return (0, 0)
        return (found.st_ino, found.st_size)

    @contextmanager
    def locked(self) -> Iterator["JournalWriter"]:
        """Be the only writer, among threads and processes, for as long as the context lasts.

        Raises:
            StorageError: The journal cannot be written.
        """
        is_new = not self.path.exists()
        try:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
        except OSError as error:
            raise StorageError(f"cannot write {self.path}: {error.strerror}; the decision was not taken") from None
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            if is_new:
                _sync_folder(self.path.parent)
            yield JournalWriter(self.path, descriptor)
        finally:
            os.close(descriptor)

    def _parse(self, number: int, line: bytes) -> ReviewEntry:
        try:
            return ReviewEntry.model_validate_json(line)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            field = ".".join(map(str, first["loc"])) or "(whole line)"
            problem = f"line {number} is no review: {field}: {first['msg']}; move the line elsewhere to go on"
            raise InvalidFileError(self.path, problem) from None


class JournalWriter:
    """Appends to a journal that is locked."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path, self._descriptor = path, descriptor

    def append(self, entry: ReviewEntry) -> None:
        """Write one line; it is on disk when this returns, and not at all if it fails.

        Raises:
            StorageError: The disk is full or cannot be written.
        """
        end = self._cut_unfinished_line()
        line = entry.model_dump_json().encode() + b"\n"
        try:
            written = os.pwrite(self._descriptor, line, end)
            while written < len(line):
                written += os.pwrite(self._descriptor, line[written:], end + written)
            os.fsync(self._descriptor)
        except OSError as error:
            os.ftruncate(self._descriptor, end)
            raise StorageError(f"cannot write {self._path}: {error.strerror}; the decision was not taken") from None

    def _cut_unfinished_line(self) -> int:
        """The end of the last whole line, which is the end of the file afterwards."""
        size = end = os.fstat(self._descriptor).st_size
        while end and os.pread(self._descriptor, 1, end - 1) != b"\n":
            end -= 1
        if end < size:
            os.ftruncate(self._descriptor, end)
        return end


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
