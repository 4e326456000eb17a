"""Slots on a GPU, each with a scene and a task of its own: :mod:`clutter6d.envs.slots` on the device.

Simulation in float32; observation, reward and termination are the CPU's functions (:mod:`clutter6d.arrays`), on the
device, from the state in float64 with unit quaternions: a float32 angle near zero would be off by 1e-3 rad.
"""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from clutter6d.envs.action import joint_targets
from clutter6d.envs.control_mode import joint_residuals
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import BodyState, Observation, TaskArrays, make_observation
from clutter6d.envs.point_cloud import SceneClouds
from clutter6d.envs.randomisation import PhysicsDraw, vary_physics
from clutter6d.envs.reward import RewardTerms, compute_reward, finger_tips
from clutter6d.envs.termination import GoalErrors, goal_errors, is_at_goal, is_dropped, outcome_numbers
from clutter6d.geometry import quat_normalize
from clutter6d.scene import GoalPair
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from clutter6d.sim.model_variation import raise_poses
from clutter6d.sim.scene_model import SceneModel
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_buffers import BufferSizes
from clutter6d.sim.warp_runtime import torch

Slots = Int[np.ndarray, "slot"]


class WarpSlots:
    """Slots that step together on one device.

    Args:
        scenes: A scene for each slot, all with as many objects.
        config: Actions, reward and termination.
        device: ``"cuda"``, ``"cuda:1"`` ..., or ``"cpu"`` (for tests).
        sizes: Room for contacts and constraints.

    Attributes:
        batch: The simulation.
        start_poses: Poses of all objects at each slot's start.
        previous_actions: Joint residuals asked for in the last step [rad].
        steps: Control steps made since the start.
        table_heights_m: Height of each slot's table top.
    """

    def __init__(
        self,
        scenes: Sequence[SceneModel],
        config: EnvConfig | None = None,
        *,
        device: str = "cuda",
        sizes: BufferSizes | None = None,
    ) -> None:
        self.config = config or EnvConfig()
        self.batch = WarpSceneBatch(scenes, device=device, sizes=sizes)
        count, place = self.batch.size, self.batch.device
        self._task = _on_device(TaskArrays.allocate(count, scenes[0].object_count), self._tensor)
        self.start_poses = self.batch.object_poses.double()
        self.previous_actions = torch.zeros((count, 7), dtype=torch.float32, device=place)
        self.steps = torch.zeros(count, dtype=torch.long, device=place)
        self.table_heights_m = torch.zeros(count, dtype=torch.float64, device=place)
        self._latency_steps = torch.zeros(count, dtype=torch.long, device=place)
        self._has_latency = False

    @property
    def size(self) -> int:
        """Number of slots."""
        return self.batch.size

    @property
    def state(self) -> BodyState[torch.Tensor]:
        """Where everything is, in float64 with unit quaternions; a copy."""
        batch = self.batch
        poses = batch.object_poses.double()
        poses[..., 3:] = quat_normalize(poses[..., 3:])
        return BodyState(
            arm_qpos=batch.arm_qpos.double(),
            arm_qvel=batch.arm_qvel.double(),
            object_poses=poses,
            object_velocities=batch.object_velocities.double(),
        )

    def load(
        self,
        slots: Slots,
        scenes: Sequence[SceneModel],
        pairs: Sequence[GoalPair],
        *,
        physics: Sequence[PhysicsDraw] | None = None,
    ) -> None:
        """Give slots scenes and tasks, and set them to the start.

        Args:
            slots: Which.
            scenes: Their scenes.
            pairs: Their tasks.
            physics: How the physics of each differ from the scene's; ``None``: not at all.
        """
        where, heights = self._tensor(slots), np.zeros(len(slots))
        if physics is not None:
            scenes = [vary_physics(scene, draw) for scene, draw in zip(scenes, physics, strict=True)]
            heights = np.array([draw.table_height_m for draw in physics])
            self._latency_steps[where] = self._tensor(np.array([draw.latency_steps for draw in physics]))
            self._has_latency = self._has_latency or any(draw.latency_steps for draw in physics)
        self.batch.load(slots, scenes)
        self.table_heights_m[where] = self._tensor(heights)
        starts = raise_poses(np.stack([pair.object_poses for pair in pairs]), heights[:, None])
        self.start_poses[where] = self._tensor(starts)
        self._load_task(where, scenes, pairs, heights)
        self.reset(slots)

    def reset(self, slots: Slots) -> None:
        """Set slots to the start of their task: stored poses at rest, the arm at home."""
        where = self._tensor(slots)
        self.batch.reset(where, self.start_poses[where])
        self.previous_actions[where] = 0
        self.steps[where] = 0

    def step(self, actions: Float32[torch.Tensor, "slot action"]) -> Bool[torch.Tensor, "slot"]:
        """Command all slots and advance them by one control step of 0.1 s.

        Returns:
            Which of them became unstable; they keep the state they had.
        """
        arm_qpos, config = self.batch.arm_qpos.double(), self.config.action
        residuals = joint_residuals(actions, arm_qpos, config)
        old_targets = self.batch.joint_targets.clone()
        self.batch.joint_targets.copy_(joint_targets(residuals, arm_qpos, config))
        self.previous_actions.copy_(residuals)
        self.steps += 1
        before = self.batch.save()
        if self._has_latency:
            self.batch.step_delayed(old_targets, self._latency_steps)
        else:
            self.batch.step()
        failed = self.batch.is_unstable()
        self.batch.restore(before, failed)
        return failed

    def errors(self) -> GoalErrors[torch.Tensor]:
        """How far the targets are from their goals."""
        return goal_errors(self.state.object_poses[:, 0], self._task.goals)

    def outcomes(
        self, errors: GoalErrors[torch.Tensor], is_unstable: Bool[torch.Tensor, "slot"]
    ) -> Int[torch.Tensor, "slot"]:
        """How each episode ended, as an index of :data:`~clutter6d.envs.termination.OUTCOMES`; -1 while it goes on."""
        config, above_table = self.config.termination, self.state.object_poses
        above_table[..., 2] -= self.table_heights_m[:, None]
        return outcome_numbers(
            is_success=is_at_goal(errors.position_m, errors.rotation_rad, config),
            dropped=is_dropped(above_table, config),
            is_unstable=is_unstable,
            steps=self.steps,
            config=config,
        )

    def reward(self) -> RewardTerms[torch.Tensor]:
        """Reward of the present state."""
        state = self.state
        tips = finger_tips(hand_kinematics(state.arm_qpos).pose)
        return compute_reward(state.object_poses, self.start_poses, self._task.goals, tips, self.config.reward)

    def observe(self) -> Observation[torch.Tensor]:
        """Observations of all slots."""
        state = self.state
        hand: HandKinematics[torch.Tensor] = hand_kinematics(state.arm_qpos)
        return make_observation(state, self._task, self.previous_actions, hand=hand)

    def object_states(self) -> Float32[torch.Tensor, "slot object 15"]:
        """Privileged: pose, velocities, mass and friction of every object, as the CPU's ``object_states``."""
        state, batch = self.state, self.batch
        physics = torch.stack([batch.object_masses_kg(), batch.object_frictions()], dim=2)
        return torch.cat([state.object_poses, state.object_velocities, physics], dim=2).float()

    def _load_task(
        self,
        where: Int[torch.Tensor, "slot"],
        scenes: Sequence[SceneModel],
        pairs: Sequence[GoalPair],
        heights: Float64[np.ndarray, "slot"],
    ) -> None:
        host = TaskArrays.allocate(len(scenes), scenes[0].object_count)
        for row, (scene, pair) in enumerate(zip(scenes, pairs, strict=True)):
            host.load(row, scene, pair.goal)
        self._task.goals[where] = self._tensor(raise_poses(host.goals, heights))
        self._task.physics[where] = self._tensor(host.physics)
        for name in ("points", "point_mass", "target_centroid"):
            getattr(self._task.clouds, name)[where] = self._tensor(getattr(host.clouds, name))

    def _tensor(self, values: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(self.batch.device)


def _on_device(host: TaskArrays[np.ndarray], tensor: Callable[[np.ndarray], torch.Tensor]) -> TaskArrays[torch.Tensor]:
    clouds = SceneClouds(
        points=tensor(host.clouds.points),
        point_mass=tensor(host.clouds.point_mass),
        target_centroid=tensor(host.clouds.target_centroid),
        hand_points=tensor(host.clouds.hand_points),
    )
    return TaskArrays(clouds=clouds, goals=tensor(host.goals), physics=tensor(host.physics))
