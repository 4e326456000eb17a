"""What of a library may be annotated: which values, by where they came from, and of which assets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import get_args

from clutter6d.assets.asset import Asset, Provenance
from clutter6d.assets.attribute_change import ATTRIBUTES, AttributeChange, value_of
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.standing import standing_decisions
from clutter6d.errors import Clutter6DError, UnknownNameError

ANNOTATORS = ("rule", "vlm")
_SAME_RATIO = 0.1
"""By how much two numbers may differ and still say the same: a volume that parts give is not exact."""


@dataclass(frozen=True, kw_only=True, slots=True)
class AnnotationSettings:
    """How a library is annotated.

    Attributes:
        overwrite: Origins of the values that may be replaced; others stay.
        concurrency: Assets asked for at the same time.
        limit: Assets that are looked at, of those with values that may be replaced.
        is_dry_run: Change nothing and ask nobody.
    """

    overwrite: frozenset[Provenance] = frozenset({"rule"})
    concurrency: int = 4
    limit: int | None = None
    is_dry_run: bool = False


def replaceable_origins(names: Sequence[str]) -> frozenset[Provenance]:
    """Origins by name, and ``rule``, whose values are always there to be replaced.

    Raises:
        UnknownNameError: There is no such origin.
    """
    known: tuple[Provenance, ...] = get_args(Provenance)
    for name in names:
        if name not in known:
            raise UnknownNameError("origin", name, known)
    return frozenset(origin for origin in known if origin == "rule" or origin in names)


def open_attributes(asset: Asset, overwrite: frozenset[Provenance]) -> frozenset[str]:
    """Names of the values that may be replaced, by where they came from."""
    return frozenset(name for name in ATTRIBUTES if _origin(asset, name) in overwrite)


def names_to_annotate(library: AssetLibrary, settings: AnnotationSettings) -> tuple[str, ...]:
    """The assets that have values which may be replaced, up to the limit; damaged ones among them.

    A version that a reviewer accepted is as a person's, every value of it.

    Raises:
        InvalidFileError: The journal of the reviews is damaged.
    """
    accepted = frozenset[str]() if "person" in settings.overwrite else _accepted_hashes(library)
    open_names = (name for name in library.names() if _is_open(library, name, accepted, settings.overwrite))
    return tuple(islice(open_names, settings.limit))


def _is_open(library: AssetLibrary, name: str, accepted: frozenset[str], overwrite: frozenset[Provenance]) -> bool:
    try:
        file = library.describe(name)
    except Clutter6DError:
        return True
    origins = {getattr(file.attributes, f"{item.removesuffix('_kg')}_from") for item in ATTRIBUTES}
    return file.content_hash not in accepted and bool(origins & overwrite)


def _accepted_hashes(library: AssetLibrary) -> frozenset[str]:
    decisions = standing_decisions(ReviewJournal(library.path).entries())
    return frozenset(key for key, entry in decisions.items() if entry.decision == "accept")


def news(asset: Asset, change: AttributeChange, opened: frozenset[str], origin: Provenance) -> AttributeChange:
    """What of a change may be made and is none already."""
    return change.only(
        *(
            name
            for name in change.given
            if name in opened
            and not (_origin(asset, name) == origin and _is_same(value_of(asset, name), getattr(change, name)))
        )
    )


def _is_same(old: str | float, new: str | float) -> bool:
    if isinstance(old, str) or isinstance(new, str):
        return old == new
    return math.isclose(old, new, rel_tol=_SAME_RATIO)


def _origin(asset: Asset, name: str) -> Provenance:
    return getattr(asset.attributes, f"{name.removesuffix('_kg')}_from")
