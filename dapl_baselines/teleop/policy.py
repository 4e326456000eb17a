"""A person as a policy: evaluated, recorded and replayed like any other."""

from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, goal_errors
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput, identity_hash
from clutter6d.play.live_view import LiveView
from clutter6d.sim.scene_model import ARM_DOF, motion_in_states
from dapl_baselines.teleop.device import TeleopDevice
from dapl_baselines.teleop.draft import Draft, draft_path
from dapl_baselines.teleop.motion import MotionConfig
from dapl_baselines.teleop.operator import KeySource, Operator
from dapl_baselines.teleop.pace import Pace
from dapl_baselines.teleop.status import Status, to_page


class TeleopPolicy:
    """Joint residuals from a person's hands, one control step every 0.1 s on the wall's clock.

    ``act`` waits for the person before an attempt and while it is paused; simulated time stands still then. The state
    it is given is only drawn: a picture of the true poses from any side, so the person counts as privileged.

    Args:
        device: What the person holds; connected.
        folder: The evaluation's folder, where an attempt that was left is kept.
        keys: The terminal.
        view: Where the scene is shown, or ``None``.
        show: Told how things stand at every control step.
        operator: Who drives, as part of the name.
        max_steps: Control steps of an attempt.
        pace: The clock.

    Attributes:
        attempt: The number of the attempt under way, from 1.
        attempts: How many there are.
    """

    is_privileged = True
    needs_observation = False

    def __init__(
        self,
        device: TeleopDevice,
        folder: Path,
        *,
        keys: KeySource,
        show: Callable[[Status], None],
        view: LiveView | None = None,
        operator: str = "",
        max_steps: int = MAX_CONTROL_STEPS,
        pace: Pace | None = None,
    ) -> None:
        motion = MotionConfig()
        self._operator = Operator(device, keys, view, ActionConfig(), motion)
        self._folder, self._view, self._show, self._max_steps = folder, view, show, max_steps
        self._pace, self._help = pace or Pace(), device.help_lines
        self._draft: Draft | None = None
        self.attempt, self.attempts = 0, 1
        self.name = "-".join(filter(None, ["teleop", device.name, operator]))
        settings = {"device": dict(device.settings), "motion": asdict(motion), "operator": operator}
        self.policy_hash = identity_hash(f"teleop-{device.name}-v1", settings)

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Show the next attempt, and wait for the person.

        Raises:
            InvalidValueError: There is more than one episode at once.
            InvalidFileError: What was kept of the attempt is damaged.
        """
        if len(slots) != 1:
            raise InvalidValueError(f"{len(slots)} episodes at once; a person drives one, so choose --num-envs 1")
        (episode,) = episodes
        path = draft_path(self._folder, episode.scene.scene_id, episode.pair_index)
        self._draft = Draft(path, self._max_steps)
        self.attempt += 1
        left = f"goes on after step {len(self._draft)}" if len(self._draft) else ""
        self._operator.await_start(left)
        if self._view is not None:
            assets = {asset.content_hash: asset for asset in episode.scene_model.assets}
            self._view.show(episode.scene, assets, episode.pair_index)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """The person's residuals; those of an attempt that was left are made again first.

        Raises:
            OperatorLeftError: The person leaves.
            StorageError: The attempt cannot be kept.
        """
        assert self._draft is not None
        assert inputs.states is not None
        (episode,), step = inputs.episodes, int(inputs.steps[0])
        qpos, _ = motion_in_states(inputs.states[0], episode.scene_model.object_count)
        if self._view is not None:
            self._view.update(qpos)
        if step == len(self._draft):
            self._decide(episode, qpos, step)
        return self._draft[step][None]

    def _decide(self, episode: Episode, qpos: Float64[np.ndarray, "nq"], step: int) -> None:
        """Wait until the person has decided the next step."""
        assert self._draft is not None
        errors = goal_errors(qpos[None, ARM_DOF : ARM_DOF + 7], episode.pair.goal.as_row()[None])
        while step == len(self._draft):
            self._pace.wait()
            residuals = self._operator.listen(qpos[:ARM_DOF])
            if self._operator.has_given_up:
                self._draft.fill()
            elif residuals is not None:
                self._draft.append(residuals)
            self._tell(episode, step, float(errors.position_m[0]), float(errors.rotation_rad[0]))

    def _tell(self, episode: Episode, step: int, position_error_m: float, rotation_error_rad: float) -> None:
        status = Status(
            scene_id=episode.scene.scene_id,
            pair=episode.pair_index,
            number=self.attempt,
            total=self.attempts,
            step=step,
            max_steps=self._max_steps,
            position_error_m=position_error_m,
            rotation_error_rad=rotation_error_rad,
            phase=self._operator.phase,
            note=self._operator.note,
        )
        self._show(status)
        if self._view is not None:
            self._view.message(to_page(status, self._help))

    def forget(self, scene_id: str, pair: int) -> None:
        """Remove what was kept of an attempt that is over and in the journal."""
        Draft(draft_path(self._folder, scene_id, pair), self._max_steps).remove()
