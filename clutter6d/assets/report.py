"""What a processing run did, as tables: accepted and rejected, fallbacks, time, and what shapes lost."""

from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.table import Column, Table

from clutter6d.assets.asset import Asset
from clutter6d.assets.asset_file import AssetFile
from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from clutter6d.assets.review.summary import decision_names

_QUANTILES = (0.1, 0.5, 0.9, 1.0)


def summary_tables(library: AssetLibrary, records: Sequence[ProcessingRecord]) -> tuple[Table, ...]:
    """Counts, rejections by reason, fallbacks, and quantiles over the accepted."""
    accepted = [record for record in records if record.status == "accepted"]
    rejected = [record for record in records if record.status == "rejected"]
    share = len(accepted) / max(len(records), 1)
    files = [library.describe(record.asset_name) for record in accepted]
    title = f"{len(accepted)} of {len(records)} objects became assets ({share:.0%}) in {library.path}"
    fallbacks = Counter(item for record in records for item in record.fallbacks)
    counts = (_count_table("Fallbacks", fallbacks),) if fallbacks else ()
    rejections = (_rejections_table(rejected),) if rejected else ()
    return (_measures_table(title, files), *counts, *rejections)


def index_table(library: AssetLibrary) -> Table:
    """One row per asset of a library, rejected ones too; with what reviewers decided, if there were any."""
    name_column = Column("name", min_width=12, overflow="fold")
    decisions = decision_names(library)
    reviewed = ("review",) if decisions else ()
    table = Table(name_column, *reviewed, "category", "size", "longest cm", "kg", "parts", "poses", "licence", "author")
    for name in library.names(with_rejected=True):
        file = library.describe(name)
        table.add_row(
            file.name,
            *((decisions.get(file.content_hash, "-"),) if decisions else ()),
            file.attributes.category,
            file.size_class or "-",
            f"{100 * max(file.extents_m):.1f}",
            f"{file.mass_kg:.2f}",
            str(file.quality.parts),
            str(file.quality.stable_verified),
            file.licence.name,
            file.licence.author,
        )
    return table


def asset_table(asset: Asset) -> Table:
    """Everything that is known of one asset, without its geometry."""
    table = Table(title=asset.name, show_header=False)
    said, quality = asset.attributes, asset.quality
    rows = {
        "hash": asset.content_hash,
        "size": " x ".join(f"{100 * side:.1f}" for side in asset.extents_m) + f" cm ({asset.size_class or 'no class'})",
        "mass": f"{asset.mass_properties.mass_kg:.3f} kg ({said.mass_from})",
        "category": f"{said.category} ({said.category_from})",
        "colour": f"{said.colour} ({said.colour_from})",
        "material": f"{said.material} ({said.material_from})",
        "friction": f"{said.friction} ({said.friction_from})",
        "convex parts": f"{quality.parts}, {quality.part_vertices} vertices",
        "stable orientations": f"{quality.stable_verified} of {quality.stable_candidates} proposed held",
        "symmetry": f"{len(asset.symmetry.discrete_quats_wxyz)} rotations, axis {asset.symmetry.continuous_axis}",
        "volume of parts / of mesh": f"{quality.volume_ratio:.2f}",
        "Hausdorff distance": f"{1000 * quality.hausdorff_m:.1f} mm",
        "source mesh": f"{quality.source_vertices:,} vertices, watertight: {quality.source_watertight}",
        "fallbacks": ", ".join(quality.fallbacks) or "none",
        "seconds": f"{sum(quality.seconds.values()):.2f}",
        "licence": f"{asset.licence.name}, {asset.licence.author}",
        "origin": f"{asset.licence.source}: {asset.licence.source_id} {asset.licence.url}",
    }
    for key, value in rows.items():
        table.add_row(key, value)
    return table


def _measures_table(title: str, files: Sequence[AssetFile]) -> Table:
    table = Table("over the assets", *("p10", "median", "p90", "largest"), title=title)
    quality = [file.quality for file in files]
    measures = {
        "processor time, s": [sum(item.seconds.values()) for item in quality],
        "convex parts": [float(item.parts) for item in quality],
        "volume of parts / of mesh": [item.volume_ratio for item in quality],
        "Hausdorff distance, mm": [1000 * item.hausdorff_m for item in quality],
        "Hausdorff distance / longest side, %": [100 * f.quality.hausdorff_m / max(f.extents_m) for f in files],
        "stable orientations": [float(item.stable_verified) for item in quality],
        "orientations dropped": [float(max(item.stable_candidates - item.stable_verified, 0)) for item in quality],
    }
    for name, values in measures.items():
        shown = [f"{value:.3g}" for value in np.quantile(values, _QUANTILES)] if values else ["-"] * len(_QUANTILES)
        table.add_row(name, *shown)
    return table


def _count_table(title: str, counts: Counter[str]) -> Table:
    table = Table("step", "objects", title=title)
    for name, count in counts.most_common():
        table.add_row(name, str(count))
    return table


def _rejections_table(rejected: Sequence[ProcessingRecord]) -> Table:
    table = Table("reason", "objects", "for instance", title="Rejected")
    for reason, count in Counter(record.reason for record in rejected).most_common():
        example = next(record for record in rejected if record.reason == reason)
        table.add_row(reason, str(count), f"{example.name}: {example.detail}")
    return table
