"""One episode, a control step at a time, by the evaluation's own runner: what is seen is what is scored."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.termination import Outcome
from clutter6d.eval.episode import EpisodeRecord
from clutter6d.eval.runner import EpisodeKey, EpisodeRunner, Round
from clutter6d.sim.scene_model import joint_state

REWARD_TERMS = ("proximity", "coarse", "fine", "success", "total")
_SLOT = np.zeros(1, dtype=np.int64)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Frame:
    """What there is to see at a control step's end.

    Attributes:
        step: Control steps made, those for which a success is held among them.
        qpos: Configuration, laid out as the simulator's.
        position_m: Distance of the target to its goal.
        rotation_rad: Angle to the goal.
        reward: The terms of the reward, by name.
        target_points: What the policy sees of the target [m, world frame].
        obstacle_points: What it sees of the obstacles.
        hand_points: What it sees of the hand and the fingers.
        outcome: How the episode ended, from its last step on.
        holds: Whether the success still stands, once it has been held for 1 s.
    """

    step: int
    qpos: Float64[np.ndarray, "nq"]
    position_m: float
    rotation_rad: float
    reward: dict[str, float]
    target_points: Float32[np.ndarray, "512 3"]
    obstacle_points: Float32[np.ndarray, "512 3"]
    hand_points: Float32[np.ndarray, "256 3"]
    outcome: Outcome | None
    holds: bool | None


class LiveEpisode:
    """An episode under way; call :meth:`advance` until there is a :attr:`record`.

    Args:
        runner: Runs episodes, one at once.
        key: Scene and pair.

    Attributes:
        frame: What there is to see now.
        record: What an evaluation keeps of the episode, once it is over.
        model: The scene as it is simulated.

    Raises:
        UnknownNameError: There is no such scene.
        InvalidValueError: There is no such pair, or the policy failed.
    """

    def __init__(self, runner: EpisodeRunner, key: EpisodeKey) -> None:
        self._rounds = runner.rounds([key])
        self.record: EpisodeRecord | None = None
        start = next(self._rounds)
        self.model = start.env.batch.scenes[0].model
        self.frame = _look(start, 0)

    def advance(self) -> Frame:
        """Make one control step of 0.1 s.

        Raises:
            InvalidValueError: The policy gave something else than finite float32 residuals, or failed.
        """
        played = next(self._rounds)
        self.record = played.finished[0] if played.finished else None
        self.frame = _look(played, self.frame.step + 1)
        return self.frame


def _look(played: Round, step: int) -> Frame:
    env = played.env
    errors, reward, seen = env.errors(_SLOT), env.reward(_SLOT), env.observe(_SLOT)
    row = played.finished[0].row if played.finished else played.running[0].row
    return Frame(
        step=step,
        qpos=np.array(joint_state(env.batch.object_poses[0], env.batch.arm_qpos[0]), dtype=np.float64),
        position_m=float(errors.position_m[0]),
        rotation_rad=float(errors.rotation_rad[0]),
        reward={name: float(getattr(reward, name)[0]) for name in REWARD_TERMS},
        target_points=seen["object_points"][0, :, :3].copy(),
        obstacle_points=seen["environment_points"][0, :, :3].copy(),
        hand_points=seen["end_effector_points"][0, :, :3].copy(),
        outcome=row.outcome if row else None,
        holds=played.finished[0].row.holds if played.finished else None,
    )
