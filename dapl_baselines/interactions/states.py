"""What is recorded of a simulation: the arm's and the objects' state, from which everything seen follows.

A row is the arm's joint angles [rad] and velocities [rad/s], 7 each, then 7 numbers for each object's pose (position
[m], ``wxyz``), then 6 for each object's velocity (linear [m/s] in the world frame, angular [rad/s] in its own).
"""

import numpy as np
from jaxtyping import Float64

from clutter6d.envs.observation import BodyState
from clutter6d.sim.scene_model import ARM_DOF


def row_size(objects: int) -> int:
    """Numbers in a row of so many objects."""
    return 2 * ARM_DOF + 13 * objects


def pack_states(state: BodyState[np.ndarray]) -> Float64[np.ndarray, "slot row"]:
    """One row a slot; a copy."""
    slots = len(state.arm_qpos)
    poses, velocities = state.object_poses.reshape(slots, -1), state.object_velocities.reshape(slots, -1)
    return np.concatenate([state.arm_qpos, state.arm_qvel, poses, velocities], axis=1)


def unpack_states(rows: Float64[np.ndarray, "slot row"]) -> BodyState[np.ndarray]:
    """The states in rows; views of them."""
    objects = (rows.shape[1] - 2 * ARM_DOF) // 13
    arm_qpos, arm_qvel, poses, velocities = np.split(rows, np.cumsum([ARM_DOF, ARM_DOF, 7 * objects]), axis=1)
    return BodyState(
        arm_qpos=arm_qpos,
        arm_qvel=arm_qvel,
        object_poses=poses.reshape(len(rows), objects, 7),
        object_velocities=velocities.reshape(len(rows), objects, 6),
    )
