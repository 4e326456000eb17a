"""Where assets come from, whatever it is stored in: a library's folder, a packed file, or a part of either."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from clutter6d.assets.asset import Asset
from clutter6d.errors import UnknownNameError

if TYPE_CHECKING:
    import pandas as pd


@runtime_checkable
class AssetCollection(Protocol):
    """Named assets, each read when it is asked for."""

    @property
    def path(self) -> Path:
        """Where they are, for messages."""
        ...

    def names(self) -> tuple[str, ...]:
        """Names of all assets, sorted."""
        ...

    def load(self, name_or_hash: str) -> Asset:
        """One asset by its name or content hash, checked against its hash."""
        ...

    def index(self) -> "pd.DataFrame":
        """One row per asset: name, hash, category, size, mass, parts, licence and origin."""
        ...


class AssetPool:
    """Some assets of a collection, by name.

    Args:
        whole: The collection.
        names: Names of the assets of this pool.

    Raises:
        UnknownNameError: The collection has no asset of one of the names.
    """

    def __init__(self, whole: AssetCollection, names: Iterable[str]) -> None:
        self._whole, self._names = whole, tuple(sorted(names))
        known = set(whole.names())
        for name in self._names:
            if name not in known:
                raise UnknownNameError(f"asset of {whole.path}", name, known)

    @property
    def path(self) -> Path:
        """Where the whole collection is."""
        return self._whole.path

    def names(self) -> tuple[str, ...]:
        """Names of this pool's assets, sorted."""
        return self._names

    def load(self, name_or_hash: str) -> Asset:
        """One asset by name or content hash.

        Raises:
            UnknownNameError: It is not in this pool.
        """
        asset = self._whole.load(name_or_hash)
        if asset.name not in self._names:
            raise UnknownNameError(f"asset of this pool of {self.path}", name_or_hash, self._names)
        return asset

    def index(self) -> "pd.DataFrame":
        """The rows of this pool's assets."""
        rows = self._whole.index()
        return rows[rows["name"].isin(self._names)].reset_index(drop=True)
