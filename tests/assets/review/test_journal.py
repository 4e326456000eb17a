"""The journal: appended to, whole lines only, one writer at a time, unharmed by what a power cut leaves."""

import errno
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from clutter6d.assets.review.entry import ReviewEntry
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.standing import last_undoable, rejected_hashes, standing_decisions
from clutter6d.errors import InvalidFileError, StorageError


def entry(number: int = 0, **changes: object) -> ReviewEntry:
    key = f"{number:064x}"
    fields = {"who": "ada", "decision": "accept", "asset_name": "mug", "asset_hash": key, "result_hash": key}
    return ReviewEntry(**fields | changes)


def append(journal: ReviewJournal, *entries: ReviewEntry) -> None:
    for item in entries:
        with journal.locked() as writer:
            writer.append(item)


@pytest.fixture
def journal(tmp_path: Path) -> ReviewJournal:
    return ReviewJournal(tmp_path)


def test_no_journal_is_no_decision(journal: ReviewJournal) -> None:
    assert journal.entries() == ()
    assert not journal.path.exists()


def test_entries_come_back_in_order(journal: ReviewJournal) -> None:
    entries = tuple(entry(number, reason='"quoted"\nand broken ünïcode\u2028') for number in range(5))
    append(journal, *entries)
    assert journal.entries() == entries
    assert len(journal.path.read_bytes().splitlines()) == 5


@pytest.mark.parametrize("torn", [b'{"schema_version":1,"who":"a', b"\0" * 300, b"\xff", b'{"schema_version":1}'])
def test_a_torn_last_line_is_ignored_and_cut_off(journal: ReviewJournal, torn: bytes) -> None:
    first, second = entry(1), entry(2)
    append(journal, first)
    with journal.path.open("ab") as file:
        file.write(torn)
    assert journal.entries() == (first,)
    append(journal, second)
    assert journal.entries() == (first, second)


def test_a_journal_that_is_only_torn_starts_anew(journal: ReviewJournal) -> None:
    journal.path.write_bytes(b'{"schema')
    append(journal, entry())
    assert len(journal.entries()) == 1


@pytest.mark.parametrize("line", [b"accept mug", b"", b'{"who": "ada"}', b"[" * 10_000, b"\xff\xfe"])
def test_a_damaged_line_is_named(journal: ReviewJournal, line: bytes) -> None:
    append(journal, entry(1))
    with journal.path.open("ab") as file:
        file.write(line + b"\n")
    append(journal, entry(2))
    with pytest.raises(InvalidFileError, match=r"reviews\.jsonl: line 2 is no review"):
        journal.entries()


def test_writers_at_the_same_time_lose_nothing(tmp_path: Path) -> None:
    def write(writer: int) -> None:
        append(ReviewJournal(tmp_path), *(entry(100 * writer + number) for number in range(10)))

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(write, range(6)))
    found = [int(item.asset_hash, 16) for item in ReviewJournal(tmp_path).entries()]
    assert sorted(found) == sorted(100 * writer + number for writer in range(6) for number in range(10))
    assert [number for number in found if number < 100] == list(range(10))


def test_a_full_disk_leaves_no_part_of_a_line(journal: ReviewJournal, monkeypatch: pytest.MonkeyPatch) -> None:
    append(journal, entry(1))
    pwrite = os.pwrite

    def fill_up(descriptor: int, content: bytes, offset: int) -> int:
        if len(content) < 100:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return pwrite(descriptor, content[:-50], offset)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", fill_up)
        with pytest.raises(StorageError, match="No space left on device; the decision was not taken"):
            append(journal, entry(2))
    assert journal.path.read_bytes().endswith(b"}\n")
    assert len(journal.entries()) == 1


def test_a_link_is_not_followed(journal: ReviewJournal, tmp_path: Path) -> None:
    journal.path.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StorageError, match=r"reviews\.jsonl"):
        append(journal, entry())
    assert not (tmp_path / "elsewhere").exists()


def test_the_last_decision_on_a_version_stands() -> None:
    one, two, other = entry(1), entry(1, decision="reject", reason="torn"), entry(2)
    assert standing_decisions([one, two, other]) == {one.result_hash: two, other.result_hash: other}


def test_an_undone_decision_gives_way_to_the_one_before() -> None:
    one, two = entry(1), entry(1, decision="reject", reason="torn")
    undo = entry(1, decision="undo", undoes=two.entry_id)
    assert standing_decisions([one, two, undo]) == {one.result_hash: one}


def test_an_edit_counts_for_the_version_that_it_made() -> None:
    edit = entry(1, decision="edit", result_hash="f" * 64)
    assert set(standing_decisions([edit])) == {"f" * 64}


def test_everyone_undoes_their_own() -> None:
    mine, theirs = entry(1), entry(2, who="bob")
    assert last_undoable([mine, theirs], "ada") == mine
    assert last_undoable([mine, theirs], "eve") is None


def test_rejected_versions_are_found_in_the_folder(journal: ReviewJournal, tmp_path: Path) -> None:
    append(journal, entry(1, decision="reject", reason="torn"), entry(2))
    assert rejected_hashes(tmp_path) == {f"{1:064x}"}
