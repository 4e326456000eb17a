"""Points drawn into the scene: what the policy sees, and where bodies touch."""

from enum import Flag, auto

import mujoco
import numpy as np
from jaxtyping import Float32, Float64, UInt8

from clutter6d.play.live_episode import Frame

TARGET_RGB, OBSTACLE_RGB, HAND_RGB, CONTACT_RGB = (230, 60, 40), (40, 110, 230), (250, 170, 20), (215, 0, 215)


class Overlay(Flag):
    """What is drawn over the scene."""

    NONE = 0
    POINTS = auto()
    CONTACTS = auto()


def contact_points(model: mujoco.MjModel, qpos: Float64[np.ndarray, "nq"]) -> Float32[np.ndarray, "contact 3"]:
    """Where bodies touch in a configuration [m, world frame]."""
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_collision(model, data)
    return data.contact.pos.astype(np.float32).reshape(-1, 3)


def overlay_points(
    overlay: Overlay, frame: Frame, model: mujoco.MjModel
) -> tuple[Float32[np.ndarray, "point 3"], UInt8[np.ndarray, "point 3"]]:
    """Points of a frame [m, world frame] and their colours.

    Args:
        overlay: What is drawn.
        frame: The moment.
        model: The scene as it is simulated.
    """
    groups: list[tuple[np.ndarray, tuple[int, int, int]]] = []
    if Overlay.POINTS in overlay:
        groups += [(frame.target_points, TARGET_RGB), (frame.obstacle_points, OBSTACLE_RGB)]
        groups += [(frame.hand_points, HAND_RGB)]
    if Overlay.CONTACTS in overlay:
        groups += [(contact_points(model, frame.qpos), CONTACT_RGB)]
    if not groups:
        return np.empty((0, 3), dtype=np.float32), np.empty((0, 3), dtype=np.uint8)
    colours = [np.tile(np.array(rgb, dtype=np.uint8), (len(points), 1)) for points, rgb in groups]
    return np.concatenate([points for points, _ in groups]), np.concatenate(colours)
