"""From the environment's observation to what the network takes: one state vector, one cloud; NumPy's arrays or torch's.

Both come as torch tensors; NumPy's arrays are not copied.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
import torch
from jaxtyping import Float32, Float64
from torch import Tensor

from clutter6d.sim.scene_model import ARM_DOF, SceneModel, motion_in_states
from dapl_baselines.policy.config import StatePart

CLOUD_PARTS: Final = ("object_points", "environment_points", "end_effector_points")


def state_vector(observation: Mapping[str, Any], parts: Sequence[StatePart]) -> Float32[Tensor, "row state"]:
    """The environment state ``s_env``: parts of the observation, one after the other."""
    return torch.cat([torch.as_tensor(observation[part]).flatten(1) for part in parts], dim=1)


def cloud(observation: Mapping[str, Any]) -> Float32[Tensor, "row 1280 7"]:
    """The target's 512 points, the environment's 512 and the end effector's 256."""
    return torch.cat([torch.as_tensor(observation[part]) for part in CLOUD_PARTS], dim=1)


def hand_state(observation: Mapping[str, Any]) -> Float32[Tensor, "row 9"]:
    """Where the hand is, for an encoder that is told."""
    return torch.as_tensor(observation["hand_state"])


def object_states(
    states: Float64[np.ndarray, "row state"], scenes: Sequence[SceneModel]
) -> Float32[np.ndarray, "row object 15"]:
    """The observation's ``object_states`` from full integration states, as privileged policies are given.

    Args:
        states: Rows laid out as ``SceneBatch.states``.
        scenes: The scene of each row, all with as many objects.
    """
    count = scenes[0].object_count
    qpos, qvel = motion_in_states(states, count)
    poses = qpos[:, ARM_DOF:].reshape(-1, count, 7)
    velocities = qvel[:, ARM_DOF:].reshape(-1, count, 6)
    physics = [np.stack([scene.object_masses_kg(), scene.object_frictions()], axis=1) for scene in scenes]
    return np.concatenate([poses, velocities, np.stack(physics)], axis=2).astype(np.float32)
