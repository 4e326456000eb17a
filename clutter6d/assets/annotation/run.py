"""Annotating a library: one asset after the other, each stored at once, resumable, and never over a person's word."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import Literal

from clutter6d.assets.annotation.annotator import AnnotationFailed, Annotator, Png, Subject, Suggestion, Usage
from clutter6d.assets.annotation.plan import AnnotationSettings, news, open_attributes
from clutter6d.assets.annotation.threads import map_threads
from clutter6d.assets.asset import Asset
from clutter6d.assets.attribute_change import changed_asset, value_of
from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import Clutter6DError, InvalidValueError, StorageError, UnknownNameError

MAX_FAILURES_IN_A_ROW = 5

Draw = Callable[[Asset], tuple[Png, ...]]
Status = Literal["annotated", "unchanged", "failed", "unasked"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Outcome:
    """What became of one asset.

    Attributes:
        name: The asset's name.
        status: ``unasked`` only in a dry run: the model would have to be asked.
        reason: Why not, as a short word.
        detail: Why not, in a sentence.
        changes: Old and new value of each attribute that changed.
        notes: The annotator's.
        usage: What it cost in this run.
        is_remembered: Whether an earlier run's answer was used.
    """

    name: str
    status: Status
    reason: str = ""
    detail: str = ""
    changes: dict[str, tuple[str | float, str | float]] = field(
        default_factory=dict[str, tuple[str | float, str | float]]
    )
    notes: tuple[str, ...] = ()
    usage: Usage = field(default_factory=Usage)
    is_remembered: bool = False


def annotate_library(
    library: AssetLibrary,
    names: tuple[str, ...],
    annotator: Annotator,
    draw: Draw,
    settings: AnnotationSettings,
) -> Iterator[Outcome]:
    """Annotate assets, and yield what became of each as soon as it is stored.

    Args:
        library: Is changed.
        names: As :func:`names_to_annotate` gives them.
        annotator: Whom to ask.
        draw: Makes the views; called from this thread only.
        settings: How.

    Raises:
        InvalidValueError: The endpoint cannot be used, or failed several times in a row; what was answered is kept.
        StorageError: The library cannot be written.
    """
    run = _Run(library, annotator, settings)
    subjects = (run.prepare(name, draw) for name in names)
    for subject, result in map_threads(run.ask, subjects, settings.concurrency):
        yield run.finish(subject, result)


class _Run:
    """One run's steps, and its count of failures in a row."""

    def __init__(self, library: AssetLibrary, annotator: Annotator, settings: AnnotationSettings) -> None:
        self._library = library
        self._annotator = annotator
        self._settings = settings
        self._in_a_row = 0
        self._has_answer = False

    def prepare(self, name: str, draw: Draw) -> Subject | Outcome:
        """Load and draw an asset; an asset with which that fails is done."""
        try:
            asset = self._library.load(name)
            opened = open_attributes(asset, self._settings.overwrite)
            views = draw(asset) if self._annotator.needs_views else ()
            return Subject(asset=asset, views=views, open=opened)
        except (Clutter6DError, ValueError) as error:
            if isinstance(error, StorageError):
                raise
            return Outcome(name=name, status="failed", reason="cannot-be-read", detail=" ".join(str(error).split()))

    def ask(self, subject: Subject | Outcome) -> Suggestion | None:
        """Called from several threads."""
        if isinstance(subject, Outcome):
            return None
        return self._annotator.recall(subject) if self._settings.is_dry_run else self._annotator.annotate(subject)

    def finish(self, subject: Subject | Outcome, result: Suggestion | BaseException | None) -> Outcome:
        """Store what was suggested."""
        if isinstance(subject, Outcome):
            return subject
        name = subject.asset.name
        if isinstance(result, AnnotationFailed):
            self._count(result)
            return Outcome(name=name, status="failed", reason=result.reason, detail=result.detail, usage=result.usage)
        if isinstance(result, BaseException):
            raise result
        if result is None:
            return Outcome(name=name, status="unasked")
        self._has_answer, self._in_a_row = True, 0
        return self._store(subject, result)

    def _store(self, subject: Subject, suggestion: Suggestion) -> Outcome:
        asset = subject.asset
        change = news(asset, suggestion.change, subject.open, self._annotator.origin)
        outcome = Outcome(
            name=asset.name,
            status="annotated" if change.given else "unchanged",
            changes={name: (value_of(asset, name), getattr(change, name)) for name in change.given},
            notes=suggestion.notes,
            usage=suggestion.usage,
            is_remembered=suggestion.is_remembered,
        )
        if self._settings.is_dry_run or not change.given:
            return outcome
        try:
            self._library.replace(asset.content_hash, changed_asset(asset, change, by=self._annotator.origin))
        except UnknownNameError:
            detail = "somebody else changed it meanwhile; the next run looks again"
            return replace(outcome, status="failed", reason="changed", detail=detail, changes={})
        return outcome

    def _count(self, failure: AnnotationFailed) -> None:
        """End the run where the endpoint never answered, or no longer does."""
        self._in_a_row = self._in_a_row + 1 if failure.is_of_endpoint else 0
        is_never_there = failure.reason == "unreachable" and not self._has_answer
        if is_never_there or self._in_a_row == MAX_FAILURES_IN_A_ROW:
            times = "" if is_never_there else f" {self._in_a_row} times in a row"
            raise InvalidValueError(
                f"the endpoint failed{times}, {failure.reason}: {failure.detail}; what was answered is kept: "
                "check --base-url and that it runs, then give the same command again"
            )
