"""What a journal's entries come to: which decision stands for which version of an asset, and what can be undone."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from clutter6d.assets.review.entry import ReviewEntry
from clutter6d.assets.review.journal import ReviewJournal


def standing_entries(entries: Iterable[ReviewEntry]) -> tuple[ReviewEntry, ...]:
    """Decisions that nobody took back, in order."""
    entries = tuple(entries)
    undone = {entry.undoes for entry in entries}
    return tuple(entry for entry in entries if entry.decision != "undo" and entry.entry_id not in undone)


def standing_decisions(entries: Iterable[ReviewEntry]) -> Mapping[str, ReviewEntry]:
    """The last standing decision on each version of an asset, by its content hash.

    An edit counts for the version that it made. A version that is not in here is not reviewed, whatever was decided of
    the asset's other versions.
    """
    return {entry.result_hash: entry for entry in standing_entries(entries)}


def last_undoable(entries: Sequence[ReviewEntry], who: str) -> ReviewEntry | None:
    """The reviewer's own last decision that still stands."""
    return next((entry for entry in reversed(standing_entries(entries)) if entry.who == who), None)


def rejected_hashes(library: Path) -> frozenset[str]:
    """Content hashes of the versions that reviewers of a library rejected.

    Raises:
        InvalidFileError: The journal is damaged.
    """
    decisions = standing_decisions(ReviewJournal(library).entries())
    return frozenset(key for key, entry in decisions.items() if entry.decision == "reject")
