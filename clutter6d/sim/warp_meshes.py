"""Convex parts of many assets in one pool on the device, from which every world picks its own.

MuJoCo Warp keeps the meshes of a model in flat arrays, and a geom names its mesh by ``geom_dataid``, which each world
may set for itself. So the meshes of a model are replaced by this pool. It grows as scenes are loaded: an asset is
stored once, arrays have room to spare, and only when that is used up do they move (``revision`` then rises, and a
captured graph is no longer valid).
"""

from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Int, Shaped

from clutter6d.assets.asset import Asset
from clutter6d.sim.warp_runtime import torch, warp

_FLOAT_FIELDS = ("mesh_vert", "mesh_polynormal")
_FIELDS = (
    "mesh_vertadr",
    "mesh_vertnum",
    "mesh_graphadr",
    "mesh_polynum",
    "mesh_polyadr",
    "mesh_graph",
    "mesh_polyvertadr",
    "mesh_polyvertnum",
    "mesh_polyvert",
    "mesh_polymapadr",
    "mesh_polymapnum",
    "mesh_polymap",
    *_FLOAT_FIELDS,
)
"""What collisions of convex meshes read."""

_FIRST_CAPACITY = 1024
_SIZE_STEP = 8


class MeshPool:
    """Convex meshes on a device.

    Args:
        device: The device.

    Attributes:
        revision: Rises when arrays move or sizes that a captured graph depends on change.
    """

    def __init__(self, device: torch.device) -> None:
        self.revision = 0
        self._columns = {name: _Column(name, device) for name in _FIELDS}
        self._ids: dict[str, np.ndarray] = {}
        self._polygon_vertices, self._vertex_polygons = _SIZE_STEP, _SIZE_STEP

    @property
    def meshes(self) -> int:
        """Number of meshes stored."""
        return self._columns["mesh_vertadr"].used

    @property
    def nbytes(self) -> int:
        """Memory taken by what is stored [bytes]."""
        return sum(column.used * column.row_bytes for column in self._columns.values())

    def ids(self, asset: Asset, model: mujoco.MjModel, first_geom: int) -> Int[np.ndarray, "part"]:
        """Mesh ids of an asset's parts; what is not in the pool yet is copied from a compiled model.

        Args:
            asset: The asset.
            model: A model with the asset, whose parts are consecutive geoms.
            first_geom: The first of them.
        """
        if asset.content_hash not in self._ids:
            parts = model.geom_dataid[first_geom : first_geom + len(asset.parts)]
            self._ids[asset.content_hash] = np.array([self._add(model, int(part)) for part in parts], dtype=np.int32)
        return self._ids[asset.content_hash]

    def attach(self, target: Any) -> None:
        """Let a MuJoCo Warp model use the pool's meshes."""
        for name, column in self._columns.items():
            setattr(target, name, column.as_warp())
        target.nmesh = self.meshes
        target.npolygonmax, target.nmeshdegmax = self._polygon_vertices, self._vertex_polygons

    def _add(self, model: mujoco.MjModel, mesh: int) -> int:
        self._make_room_for_polygons(model)
        polygons = _rows(int(model.mesh_polyadr[mesh]), int(model.mesh_polynum[mesh]))
        vertices = _rows(int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh]))
        added = {
            "mesh_vertadr": [self._append({"mesh_vert": model.mesh_vert[vertices]})],
            "mesh_vertnum": model.mesh_vertnum[mesh : mesh + 1],
            "mesh_graphadr": [self._append_graph(model, int(model.mesh_graphadr[mesh]))],
            "mesh_polynum": model.mesh_polynum[mesh : mesh + 1],
            "mesh_polyadr": [self._append({"mesh_polynormal": model.mesh_polynormal[polygons]})],
        }
        self._append_lists(model, "mesh_polyvert", polygons)
        self._append_lists(model, "mesh_polymap", vertices)
        return self._append(added)

    def _append_graph(self, model: mujoco.MjModel, address: int) -> int:
        """Append the hull's graph: its numbers of vertices and faces, 3 numbers a vertex, 6 a face; -1 without one."""
        if address < 0:
            return -1
        vertices, faces = model.mesh_graph[address : address + 2].tolist()
        return self._append({"mesh_graph": model.mesh_graph[_rows(address, 2 + 3 * vertices + 6 * faces)]})

    def _append_lists(self, model: mujoco.MjModel, name: str, owners: slice) -> None:
        """Lists of numbers, one for each owner (polygon or vertex): the numbers, where each list begins, its length."""
        starts, lengths = getattr(model, f"{name}adr")[owners], getattr(model, f"{name}num")[owners]
        first, stop = starts.min(), (starts + lengths).max()
        base = self._append({name: getattr(model, name)[first:stop]})
        self._append({f"{name}adr": starts - first + base, f"{name}num": lengths})

    def _append(self, rows: Mapping[str, Any]) -> int:
        """Append to columns that grow together; returns where the rows begin."""
        starts: list[int] = []
        for name, values in rows.items():
            column = self._columns[name]
            starts.append(column.used)
            self.revision += column.append(np.asarray(values))
        return starts[0]

    def _make_room_for_polygons(self, model: mujoco.MjModel) -> None:
        """Raise the sizes of the buffers for contact polygons, in steps so that this seldom happens."""
        sizes = tuple(-(-int(size) // _SIZE_STEP) * _SIZE_STEP for size in (model.npolygonmax, model.nmeshdegmax))
        if sizes[0] > self._polygon_vertices or sizes[1] > self._vertex_polygons:
            self._polygon_vertices = max(self._polygon_vertices, sizes[0])
            self._vertex_polygons = max(self._vertex_polygons, sizes[1])
            self.revision += 1


class _Column:
    """An array on the device that grows at its end."""

    def __init__(self, name: str, device: torch.device) -> None:
        self._is_vector = name in _FLOAT_FIELDS
        shape = (_FIRST_CAPACITY, 3) if self._is_vector else (_FIRST_CAPACITY,)
        dtype = torch.float32 if self._is_vector else torch.int32
        self._values = torch.zeros(shape, dtype=dtype, device=device)
        self.used = 0

    @property
    def row_bytes(self) -> int:
        return 12 if self._is_vector else 4

    def append(self, rows: Shaped[np.ndarray, "row ..."]) -> bool:
        """Append rows; returns whether the array had to move."""
        stop = self.used + len(rows)
        moved = stop > len(self._values)
        if moved:
            larger = self._values.new_zeros((max(stop, 2 * len(self._values)), *self._values.shape[1:]))
            larger[: self.used] = self._values[: self.used]
            self._values = larger
        self._values[self.used : stop] = torch.from_numpy(np.ascontiguousarray(rows)).to(self._values)
        self.used = stop
        return moved

    def as_warp(self) -> Any:
        return warp.from_torch(self._values, dtype=warp.vec3 if self._is_vector else warp.int32)


def _rows(start: int, count: int) -> slice:
    return slice(start, start + count)
