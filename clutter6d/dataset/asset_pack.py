"""Many assets in one Parquet file, so that a data set is installed with all it needs.

One row an asset, sorted by pool and name:

name, content_hash     as in a library
pool                   the pool of assets it belongs to: ``train`` or ``test``
description            ``asset.json`` of a library, without the seconds that processing took
one list column for each array of ``geometry.npz``, flattened
"""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
from pydantic import ValidationError

from clutter6d.assets.asset import Asset
from clutter6d.assets.asset_file import GEOMETRY, AssetFile, assemble_asset, asset_geometry, describe_asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.dataset.parquet import ParquetRows, write_parquet
from clutter6d.errors import InvalidFileError, UnknownNameError
from clutter6d.schema import ArraySpec, check_array

if TYPE_CHECKING:
    import pandas as pd

ROWS_PER_GROUP = 32
_WHAT = "asset pack"
_TYPES = {"f4": pa.float32(), "f8": pa.float64(), "i4": pa.int32()}
SCHEMA = pa.schema(
    [
        ("name", pa.string()),
        ("content_hash", pa.string()),
        ("pool", pa.string()),
        ("description", pa.string()),
        *((name, pa.list_(_TYPES[spec.dtype])) for name, spec in GEOMETRY.items()),
    ]
)


def write_asset_pack(path: Path, pools: Mapping[str, AssetCollection]) -> None:
    """Write the assets of several pools into one file."""
    rows = [_row(pool, pools[pool].load(name)) for pool in sorted(pools) for name in pools[pool].names()]
    write_parquet(path, pa.Table.from_pylist(rows, schema=SCHEMA), rows_per_group=ROWS_PER_GROUP)


def _row(pool: str, asset: Asset) -> dict[str, object]:
    file = describe_asset(asset)
    file = file.model_copy(update={"quality": file.quality.model_copy(update={"seconds": {}})})
    row: dict[str, object] = {"name": asset.name, "content_hash": asset.content_hash, "pool": pool}
    row["description"] = file.model_dump_json()
    return row | {name: np.ravel(array) for name, array in asset_geometry(asset).items()}


class AssetPack:
    """A packed file of assets; each is read, and checked against its hash, when it is asked for.

    Args:
        path: The file.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no asset pack.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = ParquetRows(path, SCHEMA, what=_WHAT)
        columns = self._file.columns("name", "content_hash", "pool")
        self.pool_of: dict[str, str] = dict(zip(map(str, columns["name"]), map(str, columns["pool"]), strict=True))
        self._rows = {key: row for column in ("content_hash", "name") for row, key in enumerate(columns[column])}
        if len(self._rows) != 2 * len(self._file):
            raise InvalidFileError(path, "two of its assets have the same name or hash")

    @property
    def content(self) -> bytes:
        """The file's bytes."""
        return self._file.content

    def names(self) -> tuple[str, ...]:
        """Names of all assets, sorted."""
        return tuple(sorted(self.pool_of))

    def load(self, name_or_hash: str) -> Asset:
        """One asset by its name or full content hash.

        Raises:
            UnknownNameError: There is no such asset.
            InvalidFileError: It is damaged.
        """
        if name_or_hash not in self._rows:
            raise UnknownNameError(f"asset of {self.path}", name_or_hash, self.names())
        row = self._file.row(self._rows[name_or_hash])
        file = _describe(self.path, str(row["description"][0]))
        asset = assemble_asset(self.path, file, {name: _array(self.path, row, name) for name in GEOMETRY})
        if (asset.name, asset.content_hash) != (str(row["name"][0]), str(row["content_hash"][0])):
            raise InvalidFileError(self.path, f"the row of {name_or_hash} holds asset {asset.name}")
        return asset

    def index(self) -> "pd.DataFrame":
        """One row per asset as a library's index has it, and its pool."""
        return self._index.copy()

    @cached_property
    def _index(self) -> "pd.DataFrame":
        from clutter6d.assets.library_index import make_index

        texts = self._file.columns("description")["description"]
        index = make_index(_describe(self.path, str(text)) for text in texts)
        return index.assign(pool=[self.pool_of.get(name, "") for name in index["name"]]).sort_values("name")


def _describe(path: Path, text: str) -> AssetFile:
    try:
        return AssetFile.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise InvalidFileError(path, f"not a valid {_WHAT}: {first['loc']}: {first['msg']}") from None


def _array(path: Path, row: pa.Table, name: str) -> np.ndarray:
    spec: ArraySpec = GEOMETRY[name]
    values = row[name].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    try:
        array = np.array(values, dtype=spec.dtype).reshape([-1 if side is None else side for side in spec.shape])
    except ValueError as error:
        raise InvalidFileError(path, f"array '{name}': {error}") from None
    check_array(path, name, array, spec)
    return array
