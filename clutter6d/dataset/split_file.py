"""A split as Parquet: one row a scene, complete, so that any reader of Parquet can use it.

scene_id, track, seed, index   which scene
scene_sha256                   hash of the scene's ``scene.json``
objects                        name, asset, role and stable orientation of each object; the target first
relations                      the scene graph: kind, subject, references
goal_pairs                     for each: the goal pose (x, y, z, qw, qx, qy, qz), the settled poses of all objects at
                               the start (7 numbers an object, in the order of ``objects``), stable orientations, flags
certificate                    evidence of validity
failures                       draws and states that were discarded on the way, by reason
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
from pydantic import ValidationError

from clutter6d.dataset.parquet import ParquetRows, write_parquet
from clutter6d.errors import InvalidFileError
from clutter6d.scene import Scene
from clutter6d.scene_file import SceneFile, scene_from_file, scene_sha256, scene_to_file

ROWS_PER_GROUP = 32
_WHAT = "split file"
_OBJECT = [
    ("name", pa.string()),
    ("asset_name", pa.string()),
    ("asset_hash", pa.string()),
    ("role", pa.string()),
    ("stable_index", pa.int32()),
]
_RELATION = [(name, pa.string()) for name in ("kind", "subject", "reference", "second_reference")]
_PAIR = [
    ("goal", pa.list_(pa.float64())),
    ("object_poses", pa.list_(pa.float64())),
    ("initial_stable_index", pa.int32()),
    ("goal_stable_index", pa.int32()),
    ("is_path_blocked", pa.bool_()),
    ("changes_resting_face", pa.bool_()),
]
_CERTIFICATE = [
    ("max_penetration_m", pa.float64()),
    ("max_drift_m", pa.float64()),
    ("max_drift_rad", pa.float64()),
    ("relations_hold", pa.int32()),
    ("reachable_poses", pa.int32()),
    ("engine_version", pa.string()),
    ("generator_version", pa.string()),
]
SCHEMA = pa.schema(
    [
        ("scene_id", pa.string()),
        ("track", pa.string()),
        ("seed", pa.int64()),
        ("index", pa.int64()),
        ("scene_sha256", pa.string()),
        ("objects", pa.list_(pa.struct(_OBJECT))),
        ("relations", pa.list_(pa.struct(_RELATION))),
        ("goal_pairs", pa.list_(pa.struct(_PAIR))),
        ("certificate", pa.struct(_CERTIFICATE)),
        ("failures", pa.string()),
    ]
)


def write_split(path: Path, scenes: Sequence[Scene], failures: Sequence[Mapping[str, int]]) -> None:
    """Write the scenes of a split, and what was discarded for each."""
    rows = [_to_row(scene, counts) for scene, counts in zip(scenes, failures, strict=True)]
    write_parquet(path, pa.Table.from_pylist(rows, schema=SCHEMA), rows_per_group=ROWS_PER_GROUP)


class SplitFile:
    """A split's file; scenes are read when they are asked for.

    Args:
        path: The file.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is no split file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file = ParquetRows(path, SCHEMA, what=_WHAT)
        columns = self._file.columns("scene_id", "scene_sha256")
        self.scene_ids = tuple(str(name) for name in columns["scene_id"])
        self.scene_sha256 = dict(zip(self.scene_ids, map(str, columns["scene_sha256"]), strict=True))
        if len(self.scene_sha256) != len(self.scene_ids):
            raise InvalidFileError(path, "holds a scene twice")

    @property
    def content(self) -> bytes:
        """The file's bytes."""
        return self._file.content

    def read(self, index: int) -> Scene:
        """The scene of a row.

        Raises:
            InvalidFileError: It is not a valid scene.
        """
        row = self._file.row(index).to_pylist()[0]
        try:
            return scene_from_file(SceneFile.model_validate(_to_file(row)))
        except (ValidationError, ValueError, TypeError) as error:
            reason = error.errors(include_url=False)[0]["msg"] if isinstance(error, ValidationError) else error
            raise InvalidFileError(self.path, f"scene {self.scene_ids[index]} is not valid: {reason}") from None

    def failures(self) -> tuple[dict[str, int], ...]:
        """What was discarded for each scene, by reason."""
        return tuple(json.loads(str(text)) for text in self._file.columns("failures")["failures"])


def _to_row(scene: Scene, failures: Mapping[str, int]) -> dict[str, Any]:
    row = scene_to_file(scene).model_dump(exclude={"schema_version"})
    row["goal_pairs"] = [_to_pair(pair) for pair in row["goal_pairs"]]
    return row | {"scene_sha256": scene_sha256(scene), "failures": json.dumps(dict(failures), sort_keys=True)}


def _to_pair(pair: dict[str, Any]) -> dict[str, Any]:
    goal = (*pair["goal"]["position"], *pair["goal"]["quat_wxyz"])
    flat = [value for row in pair["object_poses"] for value in row]
    return {**pair, "goal": goal, "object_poses": flat}


def _to_file(row: dict[str, Any]) -> dict[str, Any]:
    kept = {name: row[name] for name in SceneFile.model_fields if name in row}
    kept["goal_pairs"] = [_from_pair(pair) for pair in row["goal_pairs"]]
    return kept


def _from_pair(pair: dict[str, Any]) -> dict[str, Any]:
    flat = pair["object_poses"]
    if len(pair["goal"]) != 7 or not flat or len(flat) % 7:
        raise ValueError("a pose of a goal pair has not seven numbers")
    rows = [tuple(flat[start : start + 7]) for start in range(0, len(flat), 7)]
    return {**pair, "initial": _pose(rows[0]), "goal": _pose(pair["goal"]), "object_poses": rows}


def _pose(row: Sequence[float]) -> dict[str, Any]:
    return {"position": tuple(row[:3]), "quat_wxyz": tuple(row[3:])}
