"""Candidate tasks in a placed scene: initial and goal poses of the target that are free and far enough apart.

The paper draws both orientations at random from the stable ones and does not say with which weights. Here, initial
orientations are drawn evenly, so that bottles stand and books lean; goal orientations are drawn as often as a dropped
object comes to rest in them, so that a goal is a pose that pushing and toppling lead to rather than one that only a
balancing act reaches.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from clutter6d.assets.asset import Asset
from clutter6d.geometry import quat_conjugate, rotate
from clutter6d.scene import Relation
from clutter6d.scenegen.footprint import Layout, separations_m, swept_support
from clutter6d.scenegen.placement import Orientations, PlacementConfig, draw_orientations, draw_positions, is_on_table
from clutter6d.scenegen.relations import RelationRules, candidates_fulfil
from clutter6d.scenegen.track import Track

DISPLACEMENT_SLACK_M = 0.002
FACE_CHANGE_RAD = np.deg2rad(10.0)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TargetPoses:
    """Free poses of the target, before settling.

    Attributes:
        poses: Object frame to world frame.
        stable_indices: Stable orientation of each.
        supports: Support function of each footprint.
    """

    poses: Float64[np.ndarray, "n 7"]
    stable_indices: np.ndarray
    supports: Float64[np.ndarray, "n direction"]


def find_target_poses(
    *,
    asset: Asset,
    hull: Float64[np.ndarray, "point 3"],
    track: Track,
    layout: Layout,
    relations: Sequence[Relation],
    rules: RelationRules,
    config: PlacementConfig,
    count: int,
    by_probability: bool,
    rng: np.random.Generator,
) -> TargetPoses:
    """Poses of the target on the table, in its region, free of the obstacles and in the given relations to them.

    Args:
        asset: The target's asset.
        hull: Its hull points.
        track: Region and gap.
        layout: The obstacles.
        relations: What the pose must fulfil.
        rules: Thresholds of the relations.
        config: Margins.
        count: Poses drawn; fewer are free.
        by_probability: Draw orientations as often as a dropped object rests in them, instead of evenly.
        rng: Source of every draw.
    """
    options: Orientations = draw_orientations(asset, hull, count, rng, by_probability=by_probability)
    positions = draw_positions(track.target_region, count, rng)
    good = is_on_table(positions, options.supports, config.table_margin_m)
    good &= (separations_m(positions, options.supports, layout) >= track.min_gap_m).all(axis=1)
    for relation in relations:
        good &= candidates_fulfil(relation, positions, options.supports, layout, rules, slack_m=config.slack_m)
    poses = np.concatenate([positions, options.heights_m[:, None], options.quats_wxyz], axis=1)
    return TargetPoses(poses=poses[good], stable_indices=options.stable_indices[good], supports=options.supports[good])


def pair_up(initial: TargetPoses, goal: TargetPoses, min_displacement_m: float, count: int) -> list[tuple[int, int]]:
    """Up to ``count`` pairs (row of ``initial``, row of ``goal``) far enough apart; no pose is used twice."""
    offset = initial.poses[:, None, :2] - goal.poses[None, :, :2]
    far = np.hypot(offset[..., 0], offset[..., 1]) >= min_displacement_m + DISPLACEMENT_SLACK_M
    pairs: list[tuple[int, int]] = []
    for row in range(len(initial.poses)):
        free = np.flatnonzero(far[row])
        if len(free) and len(pairs) < count:
            pairs.append((row, int(free[0])))
            far[:, free[0]] = False
    return pairs


def is_path_blocked(
    initial: Float64[np.ndarray, "2"], goal: Float64[np.ndarray, "2"], support: np.ndarray, layout: Layout
) -> bool:
    """Whether the footprint, pushed straight from initial to goal position, would meet an obstacle."""
    swept = swept_support(initial, goal, support)
    return bool((separations_m(np.zeros((1, 2)), swept[None], layout) <= 0).any())


def changes_resting_face(
    initial_quats: Float64[np.ndarray, "n 4"], goal_quats: Float64[np.ndarray, "n 4"]
) -> Bool[np.ndarray, "n"]:
    """Whether the object's downward direction differs, in the object's frame, by more than 10 degrees."""
    up = np.array([0.0, 0.0, 1.0])
    before = rotate(quat_conjugate(initial_quats), np.broadcast_to(up, (len(initial_quats), 3)))
    after = rotate(quat_conjugate(goal_quats), np.broadcast_to(up, (len(goal_quats), 3)))
    return (before * after).sum(axis=-1) < np.cos(FACE_CHANGE_RAD)
