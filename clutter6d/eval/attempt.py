"""One episode under way: what was asked for, what was met, and the row that it ends with."""

import hashlib
import time
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.termination import GoalErrors, Outcome, TerminationConfig
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow, actions_sha256
from clutter6d.eval.metrics import mean_offset_cm, symmetric_rotation_error_rad
from clutter6d.eval.policy import Episode


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Look:
    """What a slot looks like at a control step's end.

    Attributes:
        position_m: Distance of the target to its goal.
        planar_m: The same on the table plane.
        rotation_rad: Angle to the goal.
        object_poses: Poses of all objects.
        state: The simulation's full state.
    """

    position_m: float
    planar_m: float
    rotation_rad: float
    object_poses: Float64[np.ndarray, "object 7"]
    state: Float64[np.ndarray, "state"]

    @classmethod
    def of_row(
        cls,
        errors: GoalErrors,
        row: int,
        object_poses: Float64[np.ndarray, "object 7"],
        state: Float64[np.ndarray, "state"],
    ) -> "Look":
        """The look at one row of the errors."""
        return cls(
            position_m=float(errors.position_m[row]),
            planar_m=float(errors.planar_m[row]),
            rotation_rad=float(errors.rotation_rad[row]),
            object_poses=object_poses,
            state=state,
        )


@dataclass(kw_only=True, slots=True, eq=False)
class Attempt:
    """An episode that runs in a slot.

    Attributes:
        episode: The episode.
        started: When it started, by the monotonic clock.
        actions: The residuals asked for so far.
        met_planar: Whether the goal was ever met with the position taken on the table plane.
        met_symmetric: Whether it was ever met with the rotation error taken over the target's symmetries.
        row: Its row, once it has ended; a success is then held for a while.
        hold_left: Control steps for which it is still to be held.
    """

    episode: Episode
    started: float = field(default_factory=time.monotonic)
    actions: list[Float32[np.ndarray, "7"]] = field(default_factory=list)
    met_planar: bool = False
    met_symmetric: bool = False
    row: EpisodeRow | None = None
    hold_left: int = 0

    def look(self, look: Look, config: TerminationConfig) -> None:
        """Notice which of the other criteria of success are met."""
        turned = look.rotation_rad < config.rotation_tolerance_rad
        self.met_planar |= look.planar_m < config.position_tolerance_m and turned
        if look.position_m < config.position_tolerance_m and not self.met_symmetric:
            self.met_symmetric = self.symmetric_error_rad(look) < config.rotation_tolerance_rad

    def symmetric_error_rad(self, look: Look) -> float:
        """Angle to the goal, the smallest over the target's symmetries."""
        target = self.episode.scene_model.assets[0]
        goal = np.array(self.episode.pair.goal.quat_wxyz)
        return symmetric_rotation_error_rad(look.object_poses[0, 3:], goal, target.symmetry)

    def end(self, outcome: Outcome, look: Look) -> None:
        """Write the row; whether a success holds is not known yet."""
        episode = self.episode
        self.row = EpisodeRow(
            scene_id=episode.scene.scene_id,
            pair=episode.pair_index,
            track=episode.scene.track,
            outcome=outcome,
            steps=len(self.actions),
            is_success=outcome == "success",
            is_planar_success=self.met_planar,
            is_symmetric_success=self.met_symmetric,
            holds=False,
            position_error_m=look.position_m,
            planar_error_m=look.planar_m,
            rotation_error_rad=look.rotation_rad,
            symmetric_rotation_error_rad=self.symmetric_error_rad(look),
            mean_offset_cm=mean_offset_cm(episode.scene_model.assets, episode.pair.object_poses, look.object_poses),
            actions_sha256=actions_sha256(np.stack(self.actions)),
            final_state_sha256=hashlib.sha256(look.state.tobytes()).hexdigest(),
            timing_seconds=0.0,
        )

    def to_record(self, *, holds: bool) -> EpisodeRecord:
        """What is kept of the episode, which has ended."""
        assert self.row is not None
        seconds = round(time.monotonic() - self.started, 3)
        row = self.row.model_copy(update={"holds": holds, "timing_seconds": seconds})
        return EpisodeRecord(row=row, actions=np.stack(self.actions))
