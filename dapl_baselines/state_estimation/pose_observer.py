"""What a policy sees on a robot, from what a robot has: poses of the objects, the arm's joints, estimated masses.

Points are not measured: each object's canonical surface points are known (from its mesh) and moved to its pose, as in
the simulation (paper, "Dynamics Distillation and Estimation"; FoundationPose gives the poses there).
"""

from typing import Final, cast

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.assets.materials import MATERIALS
from clutter6d.envs.observation import BodyState, TaskArrays, make_observation
from clutter6d.envs.point_cloud import SceneClouds
from clutter6d.envs.point_kernel import compiled_point_clouds
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import Pose
from clutter6d.physics import CONTROL_STEP_S, TABLE_FRICTION
from clutter6d.sim.robot import FINGER_FRICTION
from dapl_baselines.state_estimation.pose_filter import PoseFilter, PoseFilterConfig

NEUTRAL_FRICTION: Final = MATERIALS["plastic"].friction
"""What the observation says of the target's friction, which a robot cannot see."""


class PoseObserver:
    """Observations of one robot from poses; velocities come from a :class:`PoseFilter`.

    Poses that are observed are those that the filter believes in, so an object that is out of sight for a few steps
    goes on as it moved.

    Args:
        surface_points: Canonical surface points of each object in its own frame [m]; the target first, as everywhere.
        masses_kg: Estimated masses.
        config: Noise of the poses, and how objects move.

    Attributes:
        filter: Tracks the objects.

    Raises:
        InvalidValueError: There is no obstacle, or not a positive mass for each object.
    """

    def __init__(
        self,
        surface_points: Float32[np.ndarray, "object 512 3"],
        masses_kg: Float64[np.ndarray, "mass"],
        config: PoseFilterConfig | None = None,
    ) -> None:
        count = len(surface_points)
        if len(masses_kg) != count or not (np.isfinite(masses_kg) & (masses_kg > 0)).all():
            raise InvalidValueError(f"masses {masses_kg.tolist()} kg: give a positive one for each of {count} objects")
        self.filter = PoseFilter((count,), config)
        self._task = TaskArrays.allocate(1, count)
        _fill_clouds(self._task.clouds, surface_points, masses_kg)
        self._task.physics[0] = masses_kg[0], NEUTRAL_FRICTION, FINGER_FRICTION[0], TABLE_FRICTION, 0.0
        self._is_placed = np.zeros(count, dtype=bool)

    def start(self, goal: Pose) -> None:
        """Begin an episode: forget all motion, and take over where the target shall go."""
        self._task.goals[0] = goal.as_row()
        self._is_placed[:] = False
        self.filter.forget(np.ones_like(self._is_placed))

    def observe(
        self,
        object_poses: Float64[np.ndarray, "object 7"],
        arm_qpos: Float64[np.ndarray, "7"],
        arm_qvel: Float64[np.ndarray, "7"],
        previous_action: Float32[np.ndarray, "7"],
        *,
        dt_s: float = CONTROL_STEP_S,
    ) -> dict[str, Float32[np.ndarray, "..."]]:
        """The observation of one control step, as Gymnasium's environment gives it.

        The five physics parameters are privileged: in their place stand the target's estimated mass, and what the
        toolkit takes an object of plastic, its hand and its table to be.

        Args:
            object_poses: Poses from an estimator, object frame to world frame; NaN for an object that is not seen.
            arm_qpos: Joint angles [rad].
            arm_qvel: Joint velocities [rad/s].
            previous_action: Residuals asked for one step ago [rad]; zero at first.
            dt_s: Time since the last step [s].

        Raises:
            InvalidValueError: An object has not been seen since the start.
        """
        velocities = self.filter.update(object_poses, dt_s)
        self._is_placed |= self.filter.is_tracked
        if not self._is_placed.all():
            unseen = np.flatnonzero(~self._is_placed).tolist()
            raise InvalidValueError(
                f"objects {unseen} have not been seen since the start; show each to the estimator once"
            )
        state = BodyState(
            arm_qpos=arm_qpos[None],
            arm_qvel=arm_qvel[None],
            object_poses=self.filter.belief.poses[None],
            object_velocities=velocities[None],
        )
        rows = make_observation(state, self._task, previous_action[None], make_clouds=compiled_point_clouds)
        return {name: value[0] for name, value in cast(dict[str, np.ndarray], rows).items()}


def _fill_clouds(
    clouds: SceneClouds[np.ndarray],
    surface_points: Float32[np.ndarray, "object 512 3"],
    masses_kg: Float64[np.ndarray, "object"],
) -> None:
    """As :meth:`SceneClouds.load`, without a scene."""
    clouds.points[0] = np.swapaxes(surface_points, 1, 2)
    clouds.point_mass[0] = masses_kg / surface_points.shape[1]
    clouds.target_centroid[0, :, 0] = surface_points[0].mean(axis=0, dtype=np.float64)
