"""Choosing objects of Objaverse: filters, licences and size cohorts judged by annotations alone, resumable.

The order in which objects are looked at depends on the seed alone, and so does the list. What was judged is kept beside
the list until the list is whole, so that a run that is killed goes on where it was.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from clutter6d.assets.mesh_io import MeshLimits
from clutter6d.assets.sources.objaverse import check_categories, check_licences
from clutter6d.assets.sources.objaverse_annotation import PERMISSIVE, Downloader, annotations_online, parse_annotation
from clutter6d.assets.sources.objaverse_list import ListedObject, write_list
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.schema import canonical_json, read_bytes, write_bytes
from clutter6d.seeding import generator

MAX_FACES = 50_000
_BATCH = 2048
"""Objects asked for at once: the package reads most of its files for every question, however small."""

_MAX_PARTIAL_BYTES = 256 << 20


@dataclass(frozen=True, kw_only=True, slots=True)
class CurationSettings:
    """Which objects are wanted.

    Attributes:
        count: Objects in the list.
        large_share: Share of large ones (0.25 to 0.35 m once processed); the others are small.
        seed: Decides the order in which objects are looked at.
        licences: Licences that pass.
        categories: LVIS categories; things of a table-top if ``None``.
        limits: Largest mesh (paper, "Object Selection and Geometry Filtering").
        max_faces: Most triangles.
    """

    count: int = 256
    large_share: float = 0.5
    seed: int = 0
    licences: tuple[str, ...] = PERMISSIVE
    categories: tuple[str, ...] | None = None
    limits: MeshLimits = field(default_factory=MeshLimits)
    max_faces: int = MAX_FACES

    def __post_init__(self) -> None:
        """Refuse wishes that nothing fulfils."""
        if self.count < 1:
            raise InvalidValueError(f"count is {self.count}; at least 1 object is needed")
        if not 0 <= self.large_share <= 1:
            raise InvalidValueError(f"large share is {self.large_share}; it must be within 0 and 1")
        check_licences(self.licences)

    @property
    def quotas(self) -> dict[str, int]:
        """Objects wanted of each size cohort."""
        large = round(self.count * self.large_share)
        return {"large": large, "small": self.count - large}


@dataclass(frozen=True, kw_only=True, slots=True)
class CurationState:
    """How far a run is.

    Attributes:
        judged: Objects looked at.
        candidates: Objects that may be looked at.
        chosen: Objects that passed, in the order of the list.
        refused: Those that did not, by reason.
    """

    judged: int
    candidates: int
    chosen: tuple[ListedObject, ...]
    refused: dict[str, int]


def partial_path(out: Path) -> Path:
    """Where an unfinished run is kept."""
    return out.with_name(out.name + ".partial")


def curate(package: Downloader, settings: CurationSettings, out: Path) -> Iterator[CurationState]:
    """Choose objects and write the list; yields how far it is after every few hundred objects.

    Args:
        package: The ``objaverse`` package.
        settings: Which objects are wanted.
        out: The list, a CSV.

    Raises:
        InvalidValueError: The list is there already, or an unfinished run with other settings is.
        InvalidFileError: The unfinished run is damaged.
        UnknownNameError: A category is not one of LVIS.
        StorageError: The annotations could not be downloaded, or nothing can be written.
    """
    if out.exists():
        raise InvalidValueError(f"{out} is there already; remove it, or choose another --out")
    state = _read_partial(out, settings)
    with annotations_online():
        lvis = package.load_lvis_annotations()
    candidates = _in_order(settings, lvis)
    state = replace(state, candidates=len(candidates))
    yield state
    while state.judged < len(candidates) and len(state.chosen) < settings.count:
        batch = candidates[state.judged : state.judged + _BATCH]
        with annotations_online():
            records = package.load_annotations([uid for uid, _ in batch])
        state = _judge(batch, records, state, settings)
        _write_partial(out, settings, state)
        yield state
    write_list(out, state.chosen)
    partial_path(out).unlink(missing_ok=True)


def _in_order(settings: CurationSettings, lvis: Mapping[str, list[str]]) -> list[tuple[str, str]]:
    """Each uid with its category: categories take turns, objects of one are shuffled."""
    names = check_categories(settings.categories, lvis)
    ranked: list[tuple[int, int, str]] = []
    for column, name in enumerate(names):
        uids = sorted(lvis[name])
        order = generator(settings.seed, "objaverse", name).permutation(len(uids))
        ranked += [(rank, column, uids[row]) for rank, row in enumerate(order)]
    found: dict[str, str] = {}
    for _, column, uid in sorted(ranked):
        found.setdefault(uid, names[column])
    return list(found.items())


def _judge(
    batch: Sequence[tuple[str, str]], records: Mapping[str, Any], state: CurationState, settings: CurationSettings
) -> CurationState:
    chosen, refused = list(state.chosen), Counter(state.refused)
    have = Counter(str(item.size_class) for item in chosen)
    for uid, category in batch:
        annotation = parse_annotation(records.get(uid))
        if annotation is None or annotation.uid != uid:
            refused["no-annotation"] += 1
            continue
        reason = annotation.refusal(settings.licences, settings.limits)
        if reason is None and annotation.faces > settings.max_faces:
            reason = "too-many-faces"
        listed = ListedObject.of(category, annotation) if reason is None else None
        if listed is not None and have[str(listed.size_class)] >= settings.quotas[str(listed.size_class)]:
            reason = f"enough-{listed.size_class}-ones"
        if listed is None or reason is not None:
            refused[str(reason)] += 1
            continue
        chosen.append(listed)
        have[str(listed.size_class)] += 1
    return replace(state, judged=state.judged + len(batch), chosen=tuple(chosen), refused=dict(refused))


def _write_partial(out: Path, settings: CurationSettings, state: CurationState) -> None:
    content = {
        "settings": asdict(settings),
        "judged": state.judged,
        "refused": state.refused,
        "chosen": [item.model_dump() for item in state.chosen],
    }
    write_bytes(partial_path(out), canonical_json(content))


def _read_partial(out: Path, settings: CurationSettings) -> CurationState:
    path = partial_path(out)
    if not path.exists():
        return CurationState(judged=0, candidates=0, chosen=(), refused={})
    try:
        content = json.loads(read_bytes(path, what="unfinished list", max_bytes=_MAX_PARTIAL_BYTES))
        is_same = canonical_json(content["settings"]) == canonical_json(asdict(settings))
        chosen = tuple(ListedObject.model_validate(item) for item in content["chosen"])
        refused = {str(reason): int(count) for reason, count in content["refused"].items()}
        state = CurationState(judged=int(content["judged"]), candidates=0, chosen=chosen, refused=refused)
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InvalidFileError(path, "damaged; remove it to start again") from None
    if not is_same:
        raise InvalidValueError(f"{path} is an unfinished run with other settings; remove it, or choose another --out")
    return state
