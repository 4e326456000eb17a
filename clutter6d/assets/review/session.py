"""A reviewer at work on a library: decisions are taken, journalled and undone here, whoever asks for it.

The journal is written ahead of the library. If the process ends between the two, the change that the last line
promises is made before anything else is decided.
"""

import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

from clutter6d.assets.asset import Asset
from clutter6d.assets.asset_file import AssetFile
from clutter6d.assets.attribute_change import AttributeChange
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.asset_versions import edited_asset, field_changes, former_values, restored_asset
from clutter6d.assets.review.entry import MAX_NAME_LENGTH, FormerValues, ReviewEntry, Verdict
from clutter6d.assets.review.journal import JournalWriter, ReviewJournal
from clutter6d.assets.review.standing import last_undoable, standing_decisions
from clutter6d.errors import InvalidFileError, InvalidValueError


class ReviewConflictError(InvalidValueError):
    """Somebody else was faster: what was decided on is no longer what the library holds."""


class UnknownVersionError(InvalidValueError):
    """The library does not hold this version of any asset: never did, or does not any more."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ReviewStatus:
    """Where a review stands.

    Attributes:
        assets: What is said of every asset, rejected ones too, by name in alphabetical order.
        decisions: The standing decision on each version, by its content hash.
        undoable: What this reviewer's next undo takes back.
    """

    assets: Mapping[str, AssetFile]
    decisions: Mapping[str, ReviewEntry]
    undoable: ReviewEntry | None

    def decision_on(self, name: str) -> ReviewEntry | None:
        """The decision on the version of an asset that the library holds."""
        return self.decisions.get(self.assets[name].content_hash)


class ReviewSession:
    """Decisions of one reviewer; may be used by several threads, and beside other processes.

    Args:
        library: The library.
        reviewer: Who decides.

    Raises:
        InvalidValueError: The reviewer has no usable name.
        InvalidFileError: The journal, or an asset's description, is damaged.
    """

    def __init__(self, library: AssetLibrary, reviewer: str) -> None:
        if not reviewer.strip() or not reviewer.isprintable() or len(reviewer) > MAX_NAME_LENGTH:
            raise InvalidValueError(f"--reviewer {reviewer!r}: must be 1 to {MAX_NAME_LENGTH} printable characters")
        self.reviewer = reviewer.strip()
        self.path = library.path
        self._library = library
        self._journal = ReviewJournal(library.path)
        self._lock = threading.RLock()
        self._entries: tuple[ReviewEntry, ...] = ()
        self._assets: dict[str, AssetFile] = {}
        self._seen: tuple[int, ...] = ()
        with self._writing():
            pass

    def status(self) -> ReviewStatus:
        """Where the review stands, other processes' decisions included."""
        with self._current():
            return ReviewStatus(
                assets=dict(self._assets),
                decisions=standing_decisions(self._entries),
                undoable=last_undoable(self._entries, self.reviewer),
            )

    def load(self, asset_hash: str) -> Asset:
        """Read one asset.

        Raises:
            UnknownVersionError: The library does not hold this version.
            InvalidFileError: The asset is damaged.
        """
        with self._current():
            return self._library.load(self._find(asset_hash).name)

    def decide(
        self, asset_hash: str, verdict: Verdict, *, change: AttributeChange | None = None, reason: str = ""
    ) -> ReviewEntry:
        """Accept, edit or reject the version of an asset that the reviewer saw; on disk when this returns.

        Args:
            asset_hash: Content hash of that version.
            verdict: The decision.
            change: New values, for an edit.
            reason: Why; required for a rejection.

        Raises:
            UnknownVersionError: The library does not hold this version.
            InvalidValueError: The edit changes nothing, the rejection has no reason, or a value is out of its range.
            StorageError: The disk is full or cannot be written.
        """
        if verdict == "reject" and not reason.strip():
            raise InvalidValueError("a rejection needs a reason")
        if (verdict == "edit") != (change is not None and bool(change.given)):
            raise InvalidValueError("an edit, and nothing else, needs at least one new value")
        with self._writing() as journal:
            entry = ReviewEntry(
                who=self.reviewer,
                decision=verdict,
                asset_name=self._find(asset_hash).name,
                asset_hash=asset_hash,
                result_hash=asset_hash,
                reason=reason.strip(),
            )
            self._take(journal, self._with_edit(entry, change) if change is not None else entry)
            return self._entries[-1]

    def undo(self, entry_id: str) -> ReviewEntry:
        """Take back this reviewer's last standing decision, and with an edit the values that it brought.

        Args:
            entry_id: That decision, as the reviewer saw it.

        Raises:
            ReviewConflictError: It is not the last any more, or its asset was changed since.
            StorageError: The disk is full or cannot be written.
        """
        with self._writing() as journal:
            last = last_undoable(self._entries, self.reviewer)
            if last is None or last.entry_id != entry_id:
                raise ReviewConflictError("this is not your last decision any more; look at the page again")
            current = self._assets.get(last.asset_name)
            if last.former is not None and (current is None or current.content_hash != last.result_hash):
                raise ReviewConflictError(f"{last.asset_name} was changed since your edit, which cannot be undone now")
            entry = ReviewEntry(
                who=self.reviewer,
                decision="undo",
                asset_name=last.asset_name,
                asset_hash=last.result_hash,
                result_hash=last.asset_hash,
                undoes=last.entry_id,
            )
            self._take(journal, entry)
            return entry

    def _with_edit(self, entry: ReviewEntry, change: AttributeChange) -> ReviewEntry:
        asset = self._library.load(entry.asset_name)
        changes = field_changes(asset, change)
        edited = edited_asset(asset, changes)
        if edited.content_hash == asset.content_hash:
            raise InvalidValueError(f"{asset.name} has these values already")
        result = {"changes": changes, "former": former_values(asset), "result_hash": edited.content_hash}
        return entry.model_copy(update=result)

    def _take(self, journal: JournalWriter, entry: ReviewEntry) -> None:
        journal.append(entry)
        self._entries = (*self._entries, entry)
        self._finish_last()
        self._seen = self._version()

    def _finish_last(self) -> None:
        """Bring the library to where the last entry says it is."""
        last = self._entries[-1] if self._entries else None
        held = self._assets.get(last.asset_name) if last is not None else None
        if last is None or held is None or last.asset_hash == last.result_hash or held.content_hash != last.asset_hash:
            return
        asset = self._library.load(last.asset_name)
        former = self._former_of(last)
        changed = edited_asset(asset, last.changes) if former is None else restored_asset(asset, former)
        if changed.content_hash != last.result_hash:
            raise InvalidFileError(self._journal.path, f"entry {last.entry_id} does not fit asset {asset.name}")
        self._library.replace(last.asset_hash, changed)
        self._assets[last.asset_name] = self._library.describe(last.asset_name)

    def _former_of(self, entry: ReviewEntry) -> FormerValues | None:
        """What an undo restores; nothing for any other entry."""
        return next((item.former for item in self._entries if item.entry_id == entry.undoes), None)

    def _find(self, asset_hash: str) -> AssetFile:
        found = next((file for file in self._assets.values() if file.content_hash == asset_hash), None)
        if found is None:
            problem = f"no asset of {self.path} has the version {asset_hash[:12]}; it may have been changed since"
            raise UnknownVersionError(problem)
        return found

    def _version(self) -> tuple[int, ...]:
        """Changes whenever a decision is made, or an asset comes, goes or is changed."""
        assets = self.path / "assets"
        return (*self._journal.version(), assets.stat().st_mtime_ns if assets.exists() else 0)

    @contextmanager
    def _current(self) -> Iterator[None]:
        """Everything as it is now; waits for another process that is in the middle of a decision."""
        with self._lock:
            if self._version() != self._seen:
                with self._writing():
                    pass
            yield

    @contextmanager
    def _writing(self) -> Iterator[JournalWriter]:
        """The journal, locked, with everything that others changed or left unfinished taken into account."""
        with self._lock, self._journal.locked() as journal:
            version = self._version()
            if version != self._seen:
                self._entries = self._journal.entries()
                self._library = AssetLibrary.open(self.path)
                self._assets = {name: self._library.describe(name) for name in self._library.names(with_rejected=True)}
                self._seen = version
            self._finish_last()
            yield journal
