"""An episode as arrays: its recorded actions simulated again, with everything that was seen and paid on the way."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import cast

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.assets.asset import Attributes
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import Observation
from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.slots import ClutterSlots
from clutter6d.envs.termination import GoalErrors
from clutter6d.errors import InvalidValueError
from clutter6d.eval.episode import EpisodeRecord, EpisodeRow
from clutter6d.scene import Scene
from clutter6d.sim.scene_model import ARM_DOF, SceneModel

REWARD_TERMS = tuple(item.name for item in fields(RewardTerms))


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PointClouds:
    """The observation's point clouds; what a point's features are is told at :class:`Observation`."""

    object_points: Float32[np.ndarray, "state 512 7"]
    environment_points: Float32[np.ndarray, "state 512 7"]
    end_effector_points: Float32[np.ndarray, "state 256 7"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class RolloutStates:
    """What was seen: one row at the start and one at every control step's end; see :class:`Observation`.

    Attributes:
        hand_state: Position [m] and 6-D rotation of the hand.
        joint_state: Joint angles [rad], then joint velocities [rad/s].
        relative_goal: From the target's pose to its goal, in world axes: displacement [m] and 6-D rotation.
        physics_parameters: Target's mass [kg], target's, hand's and table's friction, target's restitution.
        previous_action: The residual asked for one step ago [rad].
        object_poses: Position [m] and quaternion ``wxyz`` of each object, world frame; the target is the first.
        object_velocities: Linear velocity [m/s] in the world frame, angular velocity [rad/s] in the object's own.
        clouds: The point clouds, if they were asked for.
    """

    hand_state: Float32[np.ndarray, "state 9"]
    joint_state: Float32[np.ndarray, "state 14"]
    relative_goal: Float32[np.ndarray, "state 9"]
    physics_parameters: Float32[np.ndarray, "state 5"]
    previous_action: Float32[np.ndarray, "state 7"]
    object_poses: Float64[np.ndarray, "state object 7"]
    object_velocities: Float64[np.ndarray, "state object 6"]
    clouds: PointClouds | None = None

    def qpos(self) -> Float64[np.ndarray, "state nq"]:
        """Configurations, for drawing them; joint angles are rounded to float32."""
        flat = self.object_poses.reshape(len(self.object_poses), -1)
        return np.concatenate([self.joint_state[:, :ARM_DOF].astype(np.float64), flat], axis=1)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Rollout:
    """One episode of ``n`` control steps.

    Attributes:
        row: How it ended; ``timing_`` columns are not part of a rollout and are zero.
        task: What was to be done, as a sentence.
        object_names: Names of the objects in the scene, in the order of the poses.
        states: What was seen; ``n + 1`` rows, the last one after the last action.
        actions: The residuals asked for [rad]; row ``i`` was chosen at state ``i`` and led to state ``i + 1``.
        rewards: The reward's terms at the end of each control step; ``n`` rows.
        errors: Distances to the goal at the end of each control step; ``n`` rows.
    """

    row: EpisodeRow
    task: str
    object_names: tuple[str, ...]
    states: RolloutStates
    actions: Float32[np.ndarray, "step 7"]
    rewards: RewardTerms
    errors: GoalErrors


def simulate_rollout(
    model: SceneModel, scene: Scene, record: EpisodeRecord, config: EnvConfig, *, point_clouds: bool = False
) -> Rollout:
    """Simulate a recorded episode again.

    Args:
        model: The compiled scene.
        scene: The scene.
        record: The episode's row and actions.
        config: Actions and reward of the evaluation that it is of.
        point_clouds: Whether to keep the point clouds: 36 KB a state.

    Raises:
        InvalidValueError: The actions lead to another end than the one recorded.
    """
    env, slot = ClutterSlots([model], config, threads=1), np.zeros(1, dtype=np.int64)
    env.load(slot, [model], [scene.goal_pairs[record.row.pair]])
    looks, rewards, errors = [_look(env, slot)], list[RewardTerms](), list[GoalErrors]()
    for action in record.actions:
        env.step(slot, action[None])
        looks.append(_look(env, slot))
        rewards.append(env.reward(slot))
        errors.append(env.errors(slot))
    if hashlib.sha256(env.batch.states[0].tobytes()).hexdigest() != record.row.final_state_sha256:
        raise InvalidValueError(
            f"{scene.scene_id} pair {record.row.pair}: the recorded actions do not lead to the recorded end here; "
            "look with: clutter6d replay"
        )
    return Rollout(
        row=record.row.model_copy(update={"timing_seconds": 0.0}),
        task=task_sentence(model.assets[0].attributes),
        object_names=model.names,
        states=_join_states(looks, point_clouds=point_clouds),
        actions=record.actions,
        rewards=RewardTerms(**{name: _join([getattr(terms, name) for terms in rewards]) for name in REWARD_TERMS}),
        errors=GoalErrors(
            position_m=_join([item.position_m for item in errors]),
            planar_m=_join([item.planar_m for item in errors]),
            rotation_rad=_join([item.rotation_rad for item in errors]),
        ),
    )


def task_sentence(target: Attributes) -> str:
    """The task in words: ``"move the red mug to the goal pose"``."""
    words = f"{target.colour} {target.category}".replace("-", " ").replace("_", " ").split()
    return f"move the {' '.join(words)} to the goal pose"


_Look = tuple[Observation, Float64[np.ndarray, "1 object 7"], Float64[np.ndarray, "1 object 6"]]


def _look(env: ClutterSlots, slot: np.ndarray) -> _Look:
    return env.observe(slot), env.batch.object_poses.copy(), env.batch.object_velocities.copy()


def _join_states(looks: Sequence[_Look], *, point_clouds: bool) -> RolloutStates:
    observations = [cast(dict[str, np.ndarray], observation) for observation, _, _ in looks]

    def joined(owner: type) -> dict[str, np.ndarray]:
        names = [item.name for item in fields(owner) if item.name in observations[0]]
        return {name: _join([observation[name] for observation in observations]) for name in names}

    return RolloutStates(
        **joined(RolloutStates),  # pyright: ignore[reportArgumentType]
        object_poses=_join([poses for _, poses, _ in looks]),
        object_velocities=_join([velocities for _, _, velocities in looks]),
        clouds=PointClouds(**joined(PointClouds)) if point_clouds else None,
    )


def _join(rows: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate(rows)
