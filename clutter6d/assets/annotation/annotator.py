"""What an annotator is: something that looks at an asset and suggests its attributes."""

from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from clutter6d.assets.asset import Asset, Provenance
from clutter6d.assets.attribute_change import AttributeChange

Png = bytes

VIEW_ANGLES_DEG = ((140.0, -22.0), (260.0, -22.0), (20.0, -22.0), (140.0, -65.0))
"""Azimuth and elevation of the views that an annotator is shown."""
VIEW_SIDE_PX = 384


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Subject:
    """What an annotator looks at.

    Attributes:
        asset: The asset.
        views: Pictures of it as PNG files, if the annotator wants them.
        open: Names of the values that may be changed, of those of :class:`AttributeChange`.
    """

    asset: Asset
    views: tuple[Png, ...] = ()
    open: frozenset[str] = frozenset()


@dataclass(frozen=True, kw_only=True, slots=True)
class Usage:
    """What answers cost: answers received, and tokens as the endpoint counts them."""

    answers: int = 0
    input_tokens: int = 0
    output_tokens: int = 0

    def __add__(self, other: "Usage") -> "Usage":
        """Both together."""
        return Usage(
            answers=self.answers + other.answers,
            input_tokens=self.input_tokens + other.input_tokens,
            output_tokens=self.output_tokens + other.output_tokens,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class Suggestion:
    """What an annotator suggests.

    Attributes:
        change: The values.
        notes: What a reader should know, for instance of a value that was dropped.
        usage: What asking for it cost now; nothing if it was remembered.
        is_remembered: Whether it is the answer of an earlier run.
    """

    change: AttributeChange
    notes: tuple[str, ...] = ()
    usage: Usage = field(default_factory=Usage)
    is_remembered: bool = False


class AnnotationFailed(Exception):
    """One asset got no suggestion; the run goes on.

    Args:
        reason: Short machine-readable reason, as counted in the summary.
        detail: What exactly happened.
        usage: What it cost all the same.
        is_of_endpoint: Whether it is the endpoint's fault and not the asset's; many in a row end the run.
    """

    def __init__(self, reason: str, detail: str, *, usage: Usage | None = None, is_of_endpoint: bool = False) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason
        self.detail = detail
        self.usage = usage or Usage()
        self.is_of_endpoint = is_of_endpoint


@runtime_checkable
class Annotator(Protocol):
    """Suggests attributes. ``annotate`` is called from several threads at once."""

    @property
    def origin(self) -> Provenance:
        """What its values are said to come from."""
        ...

    @property
    def needs_views(self) -> bool:
        """Whether it wants pictures."""
        ...

    def recall(self, subject: Subject) -> Suggestion | None:
        """The suggestion, if it needs nobody to be asked; else ``None``."""
        ...

    def annotate(self, subject: Subject) -> Suggestion:
        """The suggestion.

        Raises:
            AnnotationFailed: There is none for this asset.
            UserError: There will be none for any asset, for instance for a wrong key.
        """
        ...
