"""What reviewers decided: as tables, and as a table of plain values to export."""

import csv
import io
from collections import Counter
from collections.abc import Sequence

from rich.table import Table

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.entry import ReviewEntry
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.standing import standing_decisions, standing_entries

_VERDICTS = ("accept", "edit", "reject")
_COLUMNS: tuple[str, ...] = tuple("when who decision asset hash result_hash changes reason is_undone".split())


def decision_names(library: AssetLibrary) -> dict[str, str]:
    """The decision on each asset of a library, in a word, by the asset's content hash; for tables."""
    decisions = standing_decisions(ReviewJournal(library.path).entries())
    words = {"accept": "accepted", "edit": "edited", "reject": "rejected"}
    return {key: words[entry.decision] for key, entry in decisions.items()}


def review_tables(library: AssetLibrary) -> tuple[Table, ...]:
    """How far the review of a library is, who decided what, and why assets were rejected."""
    entries = ReviewJournal(library.path).entries()
    decisions = standing_decisions(entries)
    hashes = [library.describe(name).content_hash for name in library.names(with_rejected=True)]
    current = [decisions[key] for key in hashes if key in decisions]
    rejected = [entry for entry in current if entry.decision == "reject"]
    reviewers = _reviewer_table(f"{len(current)} of {len(hashes)} assets reviewed in {library.path}", entries, current)
    return (reviewers, _rejection_table(rejected)) if rejected else (reviewers,)


def decisions_csv(library: AssetLibrary) -> bytes:
    """Every decision ever made, undone ones too, oldest first."""
    entries = ReviewJournal(library.path).entries()
    standing = {entry.entry_id for entry in standing_entries(entries)}
    rows = [_row(entry, is_undone=entry.entry_id not in standing) for entry in entries if entry.decision != "undo"]
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, _COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue().encode()


def _row(entry: ReviewEntry, *, is_undone: bool) -> dict[str, object]:
    return {
        "when": entry.when.isoformat(),
        "who": entry.who,
        "decision": entry.decision,
        "asset": entry.asset_name,
        "hash": entry.asset_hash,
        "result_hash": entry.result_hash,
        "changes": "; ".join(f"{change.field}: {change.before} -> {change.after}" for change in entry.changes),
        "reason": entry.reason,
        "is_undone": is_undone,
    }


def _reviewer_table(title: str, entries: Sequence[ReviewEntry], current: Sequence[ReviewEntry]) -> Table:
    table = Table("reviewer", "accepted", "edited", "rejected", "undone", "last decision (UTC)", title=title)
    counts = Counter((entry.who, entry.decision) for entry in current)
    undone = Counter(entry.who for entry in entries if entry.decision == "undo")
    for who, last in sorted({entry.who: entry.when for entry in entries}.items()):
        shown = [str(counts[who, verdict]) for verdict in _VERDICTS]
        table.add_row(who, *shown, str(undone[who]), f"{last:%Y-%m-%d %H:%M:%S}")
    return table


def _rejection_table(rejected: Sequence[ReviewEntry]) -> Table:
    table = Table("asset", "reason", "by", title="Rejected, so left out of new scenes")
    for entry in rejected:
        table.add_row(entry.asset_name, entry.reason, entry.who)
    return table
