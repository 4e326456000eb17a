"""From a placed scene to its goal pairs: draw, settle, examine, keep what is valid, draw again what is missing."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int

from clutter6d.geometry import Pose
from clutter6d.scene import Certificate, GoalPair
from clutter6d.scenegen.certificate import StateReport, is_reachable, make_certificate, settle_and_check
from clutter6d.scenegen.draft import Draft
from clutter6d.scenegen.footprint import footprint_supports
from clutter6d.scenegen.generator_config import GeneratorConfig
from clutter6d.scenegen.goal_pairs import (
    TargetPoses,
    changes_resting_face,
    find_target_poses,
    is_path_blocked,
    pair_up,
)
from clutter6d.scenegen.placement import relations_of
from clutter6d.scenegen.track import Track
from clutter6d.sim.scene_model import SceneModel, compile_scene


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class _Round:
    """Candidate pairs and what was measured of them: all initial states, then all goal states."""

    initial: TargetPoses
    goal: TargetPoses
    chosen: list[tuple[int, int]]
    report: StateReport
    valid: list[int]

    @property
    def rows(self) -> Int[np.ndarray, "row"]:
        """Rows of the report that belong to valid pairs."""
        return np.array([*self.valid, *(number + len(self.chosen) for number in self.valid)], dtype=np.int64)


class PairSearch:
    """Finds the goal pairs of one placed scene.

    Args:
        draft: The placed scene.
        track: Number of pairs, region, displacement, relations of the goals.
        config: Margins and limits.
        rng: Source of every draw.
    """

    def __init__(self, draft: Draft, track: Track, config: GeneratorConfig, rng: np.random.Generator) -> None:
        self._draft, self._track, self._config, self._rng = draft, track, config, rng
        self._scene: SceneModel | None = None

    def run(self, failures: Counter[str]) -> tuple[tuple[GoalPair, ...], Certificate] | None:
        """All goal pairs and the certificate over their states, or ``None`` if too few were found.

        Args:
            failures: Failed states are counted here by reason.
        """
        pairs: list[GoalPair] = []
        rounds: list[_Round] = []
        for _ in range(self._config.rounds):
            current = self._run_round(self._track.goal_pairs - len(pairs))
            if current is None:
                return None
            failures.update(reason for reason in current.report.failures if reason is not None)
            rounds.append(current)
            pairs += self._make_pairs(current)
            if len(pairs) == self._track.goal_pairs:
                relations = len(self._draft.graph.relations)
                measured = [(each.report, each.rows) for each in rounds]
                return tuple(pairs), make_certificate(measured, relations)
            if not current.valid:
                return None
        return None

    def _run_round(self, missing: int) -> _Round | None:
        """Draw a few more pairs than are missing and examine them; ``None`` if not enough are free."""
        initial = self._draw_poses(is_goal=False)
        goal = self._draw_poses(is_goal=True)
        chosen = pair_up(initial, goal, self._track.min_displacement_m, missing + self._config.spare_pairs)
        if len(chosen) < missing:
            return None
        starts, ends = initial.poses[[first for first, _ in chosen]], goal.poses[[second for _, second in chosen]]
        report = self._examine(self._draft.states(np.concatenate([starts, ends])))
        both = zip(report.failures[: len(chosen)], report.failures[len(chosen) :], strict=True)
        valid = [number for number, failed in enumerate(both) if failed == (None, None)][:missing]
        return _Round(initial=initial, goal=goal, chosen=chosen, report=report, valid=valid)

    def _draw_poses(self, *, is_goal: bool) -> TargetPoses:
        relations = self._track.goal_relations if is_goal else relations_of(self._draft.graph, "target")
        return find_target_poses(
            asset=self._draft.assets["target"],
            hull=self._draft.hulls["target"],
            track=self._track,
            layout=self._draft.layout,
            relations=relations,
            rules=self._config.rules,
            config=self._config.placement,
            count=self._config.pose_draws,
            by_probability=is_goal,
            rng=self._rng,
        )

    def _examine(self, states: Float64[np.ndarray, "state object 7"]) -> StateReport:
        """Settle and measure states; one whose target the hand cannot reach is not valid either."""
        draft, config = self._draft, self._config
        if self._scene is None:
            self._scene = compile_scene([(name, draft.assets[name]) for name in draft.names])
        report = settle_and_check(
            self._scene,
            tuple(draft.hulls[name] for name in draft.names),
            states,
            draft.graph,
            rules=config.rules,
            limits=config.limits,
            config=config.settle,
        )
        return self._examine_reach(self._scene, report)

    def _examine_reach(self, scene: SceneModel, report: StateReport) -> StateReport:
        """Only of states without a failure."""
        rows = np.flatnonzero([reason is None for reason in report.failures])
        poses = report.poses[rows]
        _, spans = footprint_supports(self._draft.hulls["target"], poses[:, 0, 3:])
        unreachable = np.zeros(len(report.poses), dtype=bool)
        unreachable[rows] = ~is_reachable(scene, poses, poses[:, 0, 2] + spans[:, 1], self._config.limits)
        return report.with_failures("unreachable", unreachable)

    def _make_pairs(self, current: _Round) -> Sequence[GoalPair]:
        count = len(current.chosen)
        starts, ends = current.report.poses[:count], current.report.poses[count:, 0]
        faces = changes_resting_face(starts[:, 0, 3:], ends[:, 3:])
        pairs: list[GoalPair] = []
        for number in current.valid:
            first, second = current.chosen[number]
            start, end, support = starts[number], ends[number], current.initial.supports[first]
            pairs.append(
                GoalPair(
                    initial=Pose.from_row(start[0]),
                    goal=Pose.from_row(end),
                    object_poses=start,
                    initial_stable_index=int(current.initial.stable_indices[first]),
                    goal_stable_index=int(current.goal.stable_indices[second]),
                    is_path_blocked=is_path_blocked(start[0, :2], end[:2], support, self._draft.layout),
                    changes_resting_face=bool(faces[number]),
                )
            )
        return pairs
