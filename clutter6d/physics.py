"""The one set of physics options and contact rules that every simulation of the benchmark shares.

Changing a value here changes the benchmark; see ``docs/benchmark.md``.
"""

from typing import Final

import mujoco

PHYSICS_STEP_S: Final = 0.005
CONTROL_STEP_S: Final = 0.1
PHYSICS_STEPS_PER_CONTROL_STEP: Final = round(CONTROL_STEP_S / PHYSICS_STEP_S)

TABLE_FRICTION: Final = 0.3
"""Sliding friction of the table. MuJoCo takes the larger of two geoms' values, so an object's own value decides."""

ROBOT_CONTACT: Final = (1, 2)
OBJECT_CONTACT: Final = (2, 3)
TABLE_CONTACT: Final = (3, 3)
"""``(contype, conaffinity)``: objects meet everything; the robot meets objects and the table, never itself."""

COLLISION_GROUP: Final = 3
VISUAL_GROUP: Final = 2


def apply_physics_options(spec: mujoco.MjSpec) -> None:
    """Set time step, integrator and solver of a model, and angles in radians."""
    spec.compiler.degree = False
    spec.option.timestep = PHYSICS_STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.iterations = 20
    spec.option.ls_iterations = 20


def add_table(spec: mujoco.MjSpec, size_m: tuple[float, float], *, thickness_m: float = 0.05) -> None:
    """Add the static table: a box whose top is the plane z = 0 (a body resting on a plane geom can creep)."""
    contype, conaffinity = TABLE_CONTACT
    spec.worldbody.add_geom(
        name="table",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=(size_m[0] / 2, size_m[1] / 2, thickness_m / 2),
        pos=(0, 0, -thickness_m / 2),
        friction=(TABLE_FRICTION, 0.005, 0.0001),
        contype=contype,
        conaffinity=conaffinity,
        rgba=(0.80, 0.74, 0.66, 1),
    )
