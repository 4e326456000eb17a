"""A library as a table: one row an asset, with what its file says of it."""

from collections.abc import Iterable
from typing import Any

import pandas as pd

from clutter6d.assets.asset_file import AssetFile

COLUMNS = (
    "name",
    "content_hash",
    "category",
    "colour",
    "material",
    "friction",
    "size_class",
    "longest_extent_m",
    "mass_kg",
    "parts",
    "stable_orientations",
    "volume_ratio",
    "hausdorff_m",
    "fallbacks",
    "seconds",
    "licence",
    "author",
    "source",
    "source_id",
    "url",
)


def make_index(files: Iterable[AssetFile]) -> pd.DataFrame:
    """One row per asset: name, hash, category, size, mass, parts, licence and origin; all columns even if empty."""
    return pd.DataFrame([_row(file) for file in files], columns=list(COLUMNS))


def _row(file: AssetFile) -> dict[str, Any]:
    said = {
        **file.attributes.model_dump(),
        **file.model_dump(include={"name", "content_hash", "size_class", "mass_kg"}),
        "longest_extent_m": max(file.extents_m),
        "parts": file.quality.parts,
        "stable_orientations": file.quality.stable_verified,
        "volume_ratio": file.quality.volume_ratio,
        "hausdorff_m": file.quality.hausdorff_m,
        "fallbacks": len(file.quality.fallbacks),
        "seconds": sum(file.quality.seconds.values()),
        "licence": file.licence.name,
        "author": file.licence.author,
        "source": file.licence.source,
        "source_id": file.licence.source_id,
        "url": file.licence.url,
    }
    return {column: said[column] for column in COLUMNS}
