"""Contacts of single states, from the engine's own collision detection."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float64

from clutter6d.sim.scene_model import SceneModel


@dataclass(frozen=True, kw_only=True, slots=True)
class Contact:
    """One contact: names of the two bodies (``"world"`` is the table), and penetration [m], positive when deep."""

    bodies: frozenset[str]
    penetration_m: float


def find_contacts(
    scene: SceneModel, qpos: Float64[np.ndarray, "qpos"], scratch: mujoco.MjData | None = None
) -> tuple[Contact, ...]:
    """All contacts of one state, robot included; ``scratch`` saves an allocation."""
    data = mujoco.MjData(scene.model) if scratch is None else scratch
    data.qpos[:] = qpos
    mujoco.mj_kinematics(scene.model, data)
    mujoco.mj_comPos(scene.model, data)
    mujoco.mj_collision(scene.model, data)
    body_of = scene.model.geom_bodyid
    names = [scene.model.body(index).name for index in range(scene.model.nbody)]
    return tuple(
        Contact(bodies=frozenset(names[body_of[geom]] for geom in pair), penetration_m=-float(distance))
        for pair, distance in zip(data.contact.geom, data.contact.dist, strict=True)
    )


def max_penetration_m(contacts: tuple[Contact, ...]) -> float:
    """The deepest contact; 0 if there is none."""
    return max((contact.penetration_m for contact in contacts), default=0.0)


def robot_touches(scene: SceneModel, contacts: tuple[Contact, ...]) -> bool:
    """Whether a robot body is in contact with an object or the table."""
    neutral = {*scene.names, "world"}
    return any(not contact.bodies <= neutral for contact in contacts)
