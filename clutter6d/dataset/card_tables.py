"""The tables of a data card, each computed from what was measured or from the index of the assets."""

from collections import Counter
from collections.abc import Mapping, Sequence

import pandas as pd

from clutter6d.dataset.figures import FIGURES, Group, Unit, show
from clutter6d.dataset.measurement import Measurements

_MAX_LICENCE_ROWS = 30
_REASONS = {
    "no free placement": "obstacles did not fit in the clutter region, or not in the drawn relations",
    "goal infeasible": "too few of the drawn goal pairs were valid",
    "drifted": "did not come to rest where it was placed, or moved during the second after",
    "overlap": "penetrated deeper than 1 mm, or touched the robot",
    "relation broken": "a relation of the scene graph did not hold at rest",
    "fell": "left the table",
    "unreachable": "the hand cannot hover over the target without touching anything",
}


_QUANTITIES: tuple[tuple[str, str, Unit], ...] = (
    ("longest side [cm]", "longest_extent_m", "cm"),
    ("mass [kg]", "mass_kg", "kg"),
    ("convex parts", "parts", "count"),
    ("stable orientations", "stable_orientations", "count"),
)


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]], *, text_columns: Sequence[int] = (0,)) -> str:
    """A Markdown table.

    Args:
        header: One title a column.
        rows: The cells.
        text_columns: Columns that are set to the left; the others hold numbers and are set to the right.
    """
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in (header, *rows)]
    rule = "|".join("---" if column in text_columns else "---:" for column in range(len(header)))
    return "\n".join([lines[0], f"|{rule}|", *lines[1:]])


def split_table(measured: Mapping[str, Measurements]) -> str:
    """How much is in each split."""
    rows: list[tuple[str, ...]] = []
    for name, item in measured.items():
        used, is_target = item.objects["asset_hash"], item.objects["role"] == "target"
        objects = f"{len(item.objects) / len(item.scenes):g}"
        counts = (len(item.scenes), len(item.pairs), used.nunique(), used[is_target].nunique())
        scenes, pairs, assets, targets = (f"{count:,}" for count in counts)
        rows.append((name, scenes, pairs, objects, assets, targets))
    return markdown_table(("split", "scenes", "goal pairs", "objects a scene", "assets used", "of them targets"), rows)


def count_shared_assets(measured: Mapping[str, Measurements]) -> int | None:
    """Assets in scenes of train and of test splits; ``None`` if there are not both."""
    used: dict[bool, set[str]] = {True: set(), False: set()}
    for name, item in measured.items():
        used[name.endswith("train")] |= set(item.objects["asset_hash"])
    return len(used[True] & used[False]) if used[True] and used[False] else None


def figure_table(measured: Mapping[str, Measurements], group: Group) -> str:
    """The figures of one group, a column a split, with the number of goal pairs."""
    rows = [
        (figure.label, *(show(figure.read(item), figure.unit) for item in measured.values()))
        for figure in FIGURES
        if figure.group == group
    ]
    counts = ("n (goal pairs)", *(f"{len(item.pairs):,}" for item in measured.values()))
    return markdown_table(("", *measured), [*rows, counts])


def failure_table(measured: Mapping[str, Measurements], failures: Mapping[str, Mapping[str, int]]) -> str:
    """Failed draws by reason, in all and a scene; empty if nobody counted."""
    total: Counter[str] = Counter()
    for counts in failures.values():
        total.update(counts)
    rows: list[tuple[str, ...]] = []
    for reason, _ in total.most_common():
        counts = {name: failures.get(name, {}).get(reason, 0) for name in measured}
        shown = [f"{count:,} ({count / len(measured[name].scenes):.1f})" for name, count in counts.items()]
        rows.append((reason, *shown, _REASONS.get(reason, "")))
    header = ("reason", *measured, "meaning")
    return markdown_table(header, rows, text_columns=(0, len(header) - 1)) if rows else ""


def pool_table(assets: pd.DataFrame) -> str:
    """What is in each pool of assets, a column a pool."""
    pools = {str(pool): rows for pool, rows in assets.groupby("pool", sort=False)}
    lines = {pool: _pool_lines(rows, assets[assets["pool"] != pool]) for pool, rows in pools.items()}
    titles = next(iter(lines.values()))
    return markdown_table(("pool", *pools), [(title, *(lines[pool][title] for pool in pools)) for title in titles])


def _pool_lines(pool: pd.DataFrame, others: pd.DataFrame) -> dict[str, str]:
    is_new = ~pool["category"].isin(others["category"])
    a_family = pool["category"].value_counts()
    sizes = pool["size_class"].value_counts()
    lines = {
        "assets": f"{len(pool):,}",
        "large / small": f"{sizes.get('large', 0):,} / {sizes.get('small', 0):,}",
        "families": f"{len(a_family)}",
        "assets a family": f"{a_family.min()} to {a_family.max()}",
    }
    if len(others):
        lines["families of this pool only"] = f"{pool.loc[is_new, 'category'].nunique()}"
        lines["assets of those families"] = f"{is_new.sum():,} ({100 * is_new.mean():.0f} %)"
    for title, column, unit in _QUANTITIES:
        shown = (show(float(value), unit).split()[0] for value in pool[column].quantile([0.1, 0.5, 0.9]))
        lines[f"{title}: 10, 50, 90 %"] = " / ".join(shown)
    return lines


def material_table(assets: pd.DataFrame) -> str:
    """Assets of each pool by material, with friction and mass."""
    pools = list(assets["pool"].unique())
    rows: list[tuple[str, ...]] = []
    for material, group in sorted(assets.groupby("material"), key=lambda item: (-len(item[1]), str(item[0]))):
        counts = [f"{(group['pool'] == pool).sum():,}" for pool in pools]
        spans = [_span(group[column]) for column in ("friction", "mass_kg")]
        rows.append((str(material), *counts, *spans))
    return markdown_table(("material", *(f"assets, {pool}" for pool in pools), "friction", "mass [kg]"), rows)


def _span(values: pd.Series) -> str:
    low, high = f"{values.min():.2g}", f"{values.max():.2g}"
    return low if low == high else f"{low} to {high}"


def licence_table(assets: pd.DataFrame) -> str:
    """Assets by licence, source and author; authors only counted where there are many."""
    keys = ["licence", "source", "author"]
    groups = [(tuple(map(str, key)), len(rows)) for key, rows in assets.groupby(keys)]
    rows = [(*key, f"{count:,}") for key, count in sorted(groups, key=lambda item: (-item[1], item[0]))]
    if len(rows) <= _MAX_LICENCE_ROWS:
        return markdown_table((*keys, "assets"), rows, text_columns=(0, 1, 2))
    rows = [
        (str(licence), str(source), f"{group['author'].nunique():,}", f"{len(group):,}")
        for (licence, source), group in assets.groupby(["licence", "source"])
    ]
    return markdown_table(("licence", "source", "authors", "assets"), rows, text_columns=(0, 1))
