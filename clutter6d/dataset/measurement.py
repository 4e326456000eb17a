"""Scenes as three tables, from which every figure of a data card and of a comparison is read."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float64

from clutter6d.assets.asset import Asset
from clutter6d.dataset.difficulty import (
    NEIGHBOUR_M,
    PLANAR_TILT_RAD,
    covered_share,
    gaps_m,
    path_gaps_m,
    symmetric_tilt_rad,
    tilt_rad,
)
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.geometry import rotation_error_rad
from clutter6d.scene import Scene
from clutter6d.scenegen.footprint import footprint_supports, hull_points
from clutter6d.scenegen.goal_pairs import FACE_CHANGE_RAD
from clutter6d.scenegen.track import find_track


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Measurements:
    """What was measured of a collection of scenes; lengths in metres, angles in radians, masses in kilograms.

    Attributes:
        pairs: One row a goal pair.
        objects: One row a placed object, at the start of the scene's first goal pair.
        scenes: One row a scene, with its certificate.
    """

    pairs: pd.DataFrame
    objects: pd.DataFrame
    scenes: pd.DataFrame


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Shadows:
    """All objects of a scene seen from above, at the start of each goal pair; and the target at its goal."""

    positions: Float64[np.ndarray, "pair object 2"]
    supports: Float64[np.ndarray, "pair object direction"]
    goal_positions: Float64[np.ndarray, "pair 2"]
    goal_supports: Float64[np.ndarray, "pair direction"]


class _Measuring:
    """Measures one scene after another, and keeps the hull of every asset met."""

    def __init__(self) -> None:
        self._hulls: dict[str, np.ndarray] = {}

    def measure(
        self, scene: Scene, assets: Mapping[str, Asset]
    ) -> tuple[pd.DataFrame, pd.DataFrame, Mapping[str, Any]]:
        """The rows of one scene: goal pairs, objects, and the scene itself."""
        shadows = self._shadows(scene, assets)
        pairs, objects = _pair_rows(scene, assets, shadows), _object_rows(scene, assets, shadows)
        certificate = {field.name: getattr(scene.certificate, field.name) for field in fields(scene.certificate)}
        region = find_track(scene.track).clutter_region
        share = covered_share(shadows.positions[0], shadows.supports[0], region)
        return pairs, objects, {"scene_id": scene.scene_id, "covered_share": share, **certificate}

    def _shadows(self, scene: Scene, assets: Mapping[str, Asset]) -> _Shadows:
        poses = np.stack([pair.object_poses for pair in scene.goal_pairs])
        goals = np.stack([pair.goal.as_row() for pair in scene.goal_pairs])
        hulls = [self._hull(assets[item.asset_hash]) for item in scene.objects]
        supports = [footprint_supports(hull, poses[:, index, 3:])[0] for index, hull in enumerate(hulls)]
        return _Shadows(
            positions=poses[:, :, :2],
            supports=np.stack(supports, axis=1),
            goal_positions=goals[:, :2],
            goal_supports=footprint_supports(hulls[0], goals[:, 3:])[0],
        )

    def _hull(self, asset: Asset) -> Float64[np.ndarray, "point 3"]:
        if asset.content_hash not in self._hulls:
            self._hulls[asset.content_hash] = hull_points(asset)
        return self._hulls[asset.content_hash]


def measure(
    collection: SceneCollection, on_progress: Callable[[int, int], None] = lambda _done, _total: None
) -> Measurements:
    """Measure every scene of a collection.

    Args:
        collection: The scenes and their assets.
        on_progress: Called with the scenes done and their total.

    Raises:
        UnknownNameError: A scene's track is none of ours.
        InvalidFileError: A scene or an asset is damaged.
    """
    measuring = _Measuring()
    rows: list[tuple[pd.DataFrame, pd.DataFrame, Mapping[str, Any]]] = []
    for done, scene in enumerate(collection.scenes, start=1):
        rows.append(measuring.measure(scene, collection.assets_of(scene)))
        on_progress(done, len(collection.scenes))
    pairs, objects, scenes = zip(*rows, strict=True)
    return Measurements(
        pairs=pd.concat(pairs, ignore_index=True),
        objects=pd.concat(objects, ignore_index=True),
        scenes=pd.DataFrame(list(scenes)),
    )


def _pair_rows(scene: Scene, assets: Mapping[str, Asset], shadows: _Shadows) -> pd.DataFrame:
    initial = np.stack([pair.initial.as_row() for pair in scene.goal_pairs])[:, 3:]
    goal = np.stack([pair.goal.as_row() for pair in scene.goal_pairs])[:, 3:]
    obstacles = shadows.positions[:, 1:], shadows.supports[:, 1:]
    starts, footprints = shadows.positions[:, 0], shadows.supports[:, 0]
    path = path_gaps_m(starts, shadows.goal_positions, footprints, *obstacles)
    is_large = np.array([item.role == "large" for item in scene.objects[1:]])
    masses = np.array([assets[item.asset_hash].mass_properties.mass_kg for item in scene.objects])
    symmetric_tilt = symmetric_tilt_rad(initial, goal, assets[scene.target.asset_hash].symmetry)
    rows = pd.DataFrame(
        {
            "scene_id": scene.scene_id,
            "pair": np.arange(len(scene.goal_pairs)),
            "displacement_m": [pair.planar_displacement_m for pair in scene.goal_pairs],
            "rotation_rad": rotation_error_rad(initial, goal),
            "tilt_rad": tilt_rad(initial, goal),
            "symmetric_tilt_rad": symmetric_tilt,
            "is_face_changed": [pair.changes_resting_face for pair in scene.goal_pairs],
            "is_blocked": [pair.is_path_blocked for pair in scene.goal_pairs],
            "is_blocked_by_large": (path[:, is_large] <= 0).any(axis=1),
            "is_blocked_by_small": (path[:, ~is_large] <= 0).any(axis=1),
            "blockers": (path <= 0).sum(axis=1),
            "has_heavy_neighbour": ((path <= NEIGHBOUR_M) & (masses[1:] > masses[0])).any(axis=1),
            "start_gap_m": gaps_m(starts, footprints, *obstacles).min(axis=1),
            "goal_gap_m": gaps_m(shadows.goal_positions, shadows.goal_supports, *obstacles).min(axis=1),
        }
    )
    rows["is_planar"] = rows["tilt_rad"] <= PLANAR_TILT_RAD
    rows["is_planar_symmetric"] = rows["symmetric_tilt_rad"] <= PLANAR_TILT_RAD
    rows["is_face_changed_symmetric"] = rows["symmetric_tilt_rad"] > FACE_CHANGE_RAD
    rows["is_easy_symmetric"] = rows["is_planar_symmetric"] & ~rows["is_blocked"]
    rows["is_easy"] = rows["is_planar"] & ~rows["is_blocked"]
    return rows


def _object_rows(scene: Scene, assets: Mapping[str, Asset], shadows: _Shadows) -> pd.DataFrame:
    found = [assets[item.asset_hash] for item in scene.objects]
    masses = np.array([asset.mass_properties.mass_kg for asset in found])
    return pd.DataFrame(
        {
            "scene_id": scene.scene_id,
            "name": [item.name for item in scene.objects],
            "role": [item.role for item in scene.objects],
            "asset_hash": [item.asset_hash for item in scene.objects],
            "mass_kg": masses,
            "mass_ratio": np.where(np.arange(len(masses)) > 0, masses / masses[0], np.nan),
            "longest_extent_m": [asset.longest_extent_m for asset in found],
            "parts": [len(asset.parts) for asset in found],
            "stable_orientations": [len(asset.stable.heights_m) for asset in found],
            "gap_m": _obstacle_gaps_m(shadows),
        }
    )


def _obstacle_gaps_m(shadows: _Shadows) -> Float64[np.ndarray, "object"]:
    """Free distance of each obstacle from the nearest other obstacle; NaN for the target, and for a lone obstacle."""
    positions, supports = shadows.positions[0], shadows.supports[0]
    count = len(positions)
    others = np.broadcast_to(positions, (count, count, 2)), np.broadcast_to(supports, (count, *supports.shape))
    gaps = gaps_m(positions, supports, *others)
    np.fill_diagonal(gaps, np.inf)
    gaps[:, 0], gaps[0] = np.inf, np.inf
    nearest = gaps.min(axis=1)
    return np.where(np.isinf(nearest), np.nan, nearest)
