"""The robot's look."""

from collections.abc import Mapping

import mujoco


def add_visuals(spec: mujoco.MjSpec, bodies: Mapping[str, mujoco.MjsBody]) -> None:
    """Add visual geometry to the robot's bodies."""
    del spec, bodies
