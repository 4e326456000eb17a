"""How cluttered and how hard a set of scenes really is (benchmark: "Tracks")."""

from dataclasses import dataclass

import numpy as np

from clutter6d.scenegen.footprint import hull_points, layout_of, separations_m
from clutter6d.scenegen.scene_set import SceneSet


@dataclass(frozen=True, kw_only=True, slots=True)
class ClutterStatistics:
    """Figures of one set of scenes.

    Attributes:
        scenes: Number of scenes.
        pairs: Number of goal pairs.
        blocked_share: Share of goal pairs whose straight path an obstacle blocks.
        face_change_share: Share of goal pairs that need another resting face.
        median_target_gap_m: Median, over goal pairs, of the target's free distance to its nearest neighbour.
        median_obstacle_gap_m: Median, over obstacles, of the free distance to the nearest other obstacle.
    """

    scenes: int
    pairs: int
    blocked_share: float
    face_change_share: float
    median_target_gap_m: float
    median_obstacle_gap_m: float


def measure_clutter(scene_set: SceneSet) -> ClutterStatistics:
    """Measure a set of scenes."""
    target_gaps: list[float] = []
    obstacle_gaps: list[float] = []
    for scene in scene_set.scenes:
        assets = scene_set.assets_of(scene)
        hulls = tuple(hull_points(assets[item.asset_hash]) for item in scene.objects)
        names = tuple(item.name for item in scene.objects)
        for number, pair in enumerate(scene.goal_pairs):
            layout = layout_of(names, hulls, pair.object_poses)
            gaps = separations_m(layout.positions, layout.supports, layout)
            np.fill_diagonal(gaps, np.inf)
            target_gaps.append(float(gaps[0].min()))
            if number == 0:
                obstacle_gaps += gaps[1:, 1:].min(axis=1).tolist()
    pairs = [pair for scene in scene_set.scenes for pair in scene.goal_pairs]
    return ClutterStatistics(
        scenes=len(scene_set.scenes),
        pairs=len(pairs),
        blocked_share=float(np.mean([pair.is_path_blocked for pair in pairs])),
        face_change_share=float(np.mean([pair.changes_resting_face for pair in pairs])),
        median_target_gap_m=float(np.median(target_gaps)),
        median_obstacle_gap_m=float(np.median(obstacle_gaps)),
    )
