"""Evaluate a policy as it would act on a robot: it sees what noisy poses tell, not what the simulator knows."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import cast

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.observation import Observation
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, Policy, PolicyInput, identity_hash
from clutter6d.geometry import quat_multiply
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import ARM_DOF, motion_in_states
from dapl_baselines.state_estimation.pose_filter import PoseFilterConfig
from dapl_baselines.state_estimation.pose_observer import PoseObserver
from dapl_baselines.state_estimation.rotation_vectors import quat_from_rotation_vector

"""A state row begins with the time and the arm's joint angles; the objects' poses follow."""


@dataclass(frozen=True, kw_only=True, slots=True)
class EstimatorConfig:
    """A pose estimator as it is simulated, and the filter after it.

    Attributes:
        position_sigma_m: Standard deviation of a position's error, each axis [m].
        rotation_sigma_rad: The same of a rotation, about each axis [rad].
        missed_share: Share of the looks at which an object is not seen; never at the first.
        filter: The filter, which should be told the same noise.
    """

    position_sigma_m: float = 0.002
    rotation_sigma_rad: float = 0.02
    missed_share: float = 0.0
    filter: PoseFilterConfig = field(default_factory=PoseFilterConfig)


class PoseOnlyPolicy:
    """A policy that is shown observations made from noisy poses of the objects and from the arm's joints.

    It counts as privileged, since it reads the simulator's state to play the estimator. Errors are drawn for each
    seed, scene, pair and step, so that the evaluation can be replayed and does not depend on what runs at once.

    Args:
        policy: What acts.
        config: Estimator and filter.

    Raises:
        InvalidValueError: The policy sees no observation, or the simulator's state.
    """

    is_privileged = True
    needs_observation = True

    def __init__(self, policy: Policy, config: EstimatorConfig | None = None) -> None:
        if policy.is_privileged or not policy.needs_observation:
            raise InvalidValueError(f"policy '{policy.name}' does not act on observations alone; take another")
        self._policy, self._config = policy, config or EstimatorConfig()
        self.name = f"{policy.name}-from-poses"
        self.policy_hash = identity_hash("from-poses-v1", [policy.policy_hash, asdict(self._config)])
        self._observers: dict[int, PoseObserver] = {}

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Each episode has an observer of its own, which knows the objects' shapes and masses."""
        for slot, episode in zip(slots.tolist(), episodes, strict=True):
            points = np.stack([asset.surface_points for asset in episode.scene_model.assets])
            masses = episode.scene_model.object_masses_kg()
            self._observers[slot] = PoseObserver(points, masses, self._config.filter)
            self._observers[slot].start(episode.pair.goal)
        self._policy.begin(slots, episodes)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """What the policy does on the observations made from poses."""
        rows = [self._observe(inputs, row) for row in range(len(inputs.slots))]
        seen = cast(Observation, {name: np.stack([row[name] for row in rows]) for name in rows[0]})
        return self._policy.act(replace(inputs, observation=seen, states=None))

    def _observe(self, inputs: PolicyInput, row: int) -> dict[str, Float32[np.ndarray, "..."]]:
        assert inputs.observation is not None
        assert inputs.states is not None
        episode, step = inputs.episodes[row], int(inputs.steps[row])
        qpos, _ = motion_in_states(inputs.states[row], episode.scene_model.object_count)
        poses = qpos[ARM_DOF:].reshape(-1, 7)
        rng = generator(episode.seed, "pose estimator", episode.scene.scene_id, episode.pair_index, step)
        joints = inputs.observation["joint_state"][row].astype(np.float64)
        return self._observers[int(inputs.slots[row])].observe(
            estimate_poses(poses, self._config, rng, is_first=step == 0),
            joints[:ARM_DOF],
            joints[ARM_DOF:],
            inputs.observation["previous_action"][row],
        )


def estimate_poses(
    poses: Float64[np.ndarray, "object 7"], config: EstimatorConfig, rng: np.random.Generator, *, is_first: bool
) -> Float64[np.ndarray, "object 7"]:
    """Poses as an estimator gives them: with errors, and NaN where it missed the object."""
    turn = quat_from_rotation_vector(config.rotation_sigma_rad * rng.standard_normal((len(poses), 3)))
    position = poses[:, :3] + config.position_sigma_m * rng.standard_normal((len(poses), 3))
    is_missed = (rng.random((len(poses), 1)) < config.missed_share) & (not is_first)
    return np.where(is_missed, np.nan, np.concatenate([position, quat_multiply(poses[:, 3:], turn)], axis=1))
