"""A scene as stored: ``scene.json``, checked when read, exact to the bit when written."""

import hashlib
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field, model_validator

from clutter6d.geometry import Pose, is_unit
from clutter6d.scene import (
    TABLE,
    Certificate,
    GoalPair,
    PlacedObject,
    Relation,
    RelationKind,
    Role,
    Scene,
    SceneGraph,
)
from clutter6d.schema import FileModel, model_bytes, read_model, write_model

_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$"
"""Names become file names, so they hold nothing that leaves a folder."""


class _PoseModel(FileModel):
    position: tuple[float, float, float]
    quat_wxyz: tuple[float, float, float, float]

    @model_validator(mode="after")
    def _check_unit(self) -> "_PoseModel":
        if not is_unit(np.array(self.quat_wxyz)):
            raise ValueError("quaternion is not unit")
        return self


Row = tuple[float, float, float, float, float, float, float]


class _PairModel(FileModel):
    initial: _PoseModel
    goal: _PoseModel
    object_poses: tuple[Row, ...]
    initial_stable_index: int = Field(ge=0)
    goal_stable_index: int = Field(ge=0)
    is_path_blocked: bool
    changes_resting_face: bool


class _ObjectModel(FileModel):
    name: str = Field(pattern=_NAME)
    asset_name: str = Field(pattern=_NAME)
    asset_hash: str = Field(pattern="^[0-9a-f]{64}$")
    role: Role
    stable_index: int = Field(ge=0)


class _RelationModel(FileModel):
    kind: RelationKind
    subject: str
    reference: str
    second_reference: str | None = None


class _CertificateModel(FileModel):
    max_penetration_m: float
    max_drift_m: float
    max_drift_rad: float
    relations_hold: int
    reachable_poses: int
    engine_version: str
    generator_version: str


class SceneFile(FileModel):
    """A scene as stored: ``scene.json``, schema version 1."""

    schema_version: Literal[1] = 1
    scene_id: str = Field(pattern=_NAME)
    track: str
    seed: int
    index: int = Field(ge=0)
    objects: tuple[_ObjectModel, ...] = Field(min_length=1, max_length=64)
    relations: tuple[_RelationModel, ...]
    goal_pairs: tuple[_PairModel, ...] = Field(min_length=1, max_length=1024)
    certificate: _CertificateModel

    @model_validator(mode="after")
    def _check_consistency(self) -> "SceneFile":
        names = [item.name for item in self.objects]
        if len(set(names)) != len(names) or TABLE in names:
            raise ValueError("object names must be unique and none may be 'table'")
        if self.objects[0].role != "target" or any(item.role == "target" for item in self.objects[1:]):
            raise ValueError("the first object, and only it, must have the role 'target'")
        known = {*names, TABLE}
        for relation in self.relations:
            if not {relation.subject, relation.reference, relation.second_reference or TABLE} <= known:
                raise ValueError(f"relation of '{relation.subject}' names an object that is not in the scene")
        if any((item.kind == "between") != (item.second_reference is not None) for item in self.relations):
            raise ValueError("'between', and only it, has two references")
        if any(len(pair.object_poses) != len(names) for pair in self.goal_pairs):
            raise ValueError(f"every goal pair needs one pose for each of the {len(names)} objects")
        if any(pair.object_poses[0] != (*pair.initial.position, *pair.initial.quat_wxyz) for pair in self.goal_pairs):
            raise ValueError("the first object's pose must be the pair's initial pose")
        if not all(is_unit(np.array(pair.object_poses)[:, 3:]).all() for pair in self.goal_pairs):
            raise ValueError("a stored object pose has a quaternion that is not unit")
        return self


def read_scene(path: Path) -> Scene:
    """Read ``scene.json``.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not a valid scene.
    """
    return scene_from_file(read_model(path, SceneFile, what="scene file"))


def scene_from_file(file: SceneFile) -> Scene:
    """The scene of its stored form."""
    names = tuple(item.name for item in file.objects)
    return Scene(
        scene_id=file.scene_id,
        track=file.track,
        seed=file.seed,
        index=file.index,
        objects=tuple(PlacedObject(**item.model_dump()) for item in file.objects),
        graph=SceneGraph(objects=names, relations=tuple(Relation(**item.model_dump()) for item in file.relations)),
        goal_pairs=tuple(_pair_from_model(item) for item in file.goal_pairs),
        certificate=Certificate(**file.certificate.model_dump()),
    )


def write_scene(path: Path, scene: Scene) -> None:
    """Write ``scene.json`` atomically; poses round-trip to the bit."""
    write_model(path, scene_to_file(scene))


def scene_sha256(scene: Scene) -> str:
    """SHA-256 of the scene's ``scene.json``."""
    return hashlib.sha256(model_bytes(scene_to_file(scene))).hexdigest()


def scene_to_file(scene: Scene) -> SceneFile:
    """The stored form of a scene."""
    return SceneFile(
        scene_id=scene.scene_id,
        track=scene.track,
        seed=scene.seed,
        index=scene.index,
        objects=tuple(_ObjectModel(**_slots(item)) for item in scene.objects),
        relations=tuple(_RelationModel(**_slots(item)) for item in scene.graph.relations),
        goal_pairs=tuple(_pair_to_model(item) for item in scene.goal_pairs),
        certificate=_CertificateModel(**_slots(scene.certificate)),
    )


def _slots(item: PlacedObject | Relation | Certificate) -> dict[str, Any]:
    return {field.name: getattr(item, field.name) for field in fields(item)}


def _pose_to_model(pose: Pose) -> _PoseModel:
    return _PoseModel(position=pose.position, quat_wxyz=pose.quat_wxyz)


def _pose_from_model(model: _PoseModel) -> Pose:
    return Pose(position=model.position, quat_wxyz=model.quat_wxyz)


def _pair_to_model(pair: GoalPair) -> _PairModel:
    return _PairModel(
        initial=_pose_to_model(pair.initial),
        goal=_pose_to_model(pair.goal),
        object_poses=tuple(_row(row) for row in pair.object_poses),
        initial_stable_index=pair.initial_stable_index,
        goal_stable_index=pair.goal_stable_index,
        is_path_blocked=pair.is_path_blocked,
        changes_resting_face=pair.changes_resting_face,
    )


def _pair_from_model(model: _PairModel) -> GoalPair:
    return GoalPair(
        initial=_pose_from_model(model.initial),
        goal=_pose_from_model(model.goal),
        object_poses=np.array(model.object_poses, dtype=np.float64),
        initial_stable_index=model.initial_stable_index,
        goal_stable_index=model.goal_stable_index,
        is_path_blocked=model.is_path_blocked,
        changes_resting_face=model.changes_resting_face,
    )


def _row(values: Sequence[float] | np.ndarray) -> Row:
    x, y, z, qw, qx, qy, qz = (float(value) for value in values)
    return (x, y, z, qw, qx, qy, qz)
