"""The Franka Research 3 with the Franka hand, fingers closed, as part of an ``MjSpec``.

Masses, inertias, kinematics and limits are the real arm's (:mod:`clutter6d.sim.robot_facts` names the sources). The
fingers are welded shut, so the robot has 7 degrees of freedom and 7 actuators. Its collision geometry is a handful of
capsules and a box, from link 4 to the finger tips: what can reach the table.

Gravity is compensated, as the arm's own controller does. Each joint is under impedance control:
torque = kp (q_target - q) - kv dq, clipped to the motor's limit. Joints 1 to 4 have the stiffness of libfranka's joint
impedance example, 600 Nm/rad; the wrist's 110 Nm/rad keeps a step of 0.1 rad below its 12 Nm. The damping is chosen by
measurement at a physics step of 5 ms: from the home posture a step of 0.1 rad settles to 5% in 0.13 s (wrist) to
0.25 s (shoulder) with at most 3% of overshoot, stretched far out with at most 6% (``tests/sim/test_robot.py``).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

import mujoco
import numpy as np

from clutter6d.physics import COLLISION_GROUP, ROBOT_CONTACT
from clutter6d.sim import robot_facts as facts
from clutter6d.sim.end_effector import FINGERS, HAND_BOX, end_effector_points
from clutter6d.sim.kinematics import hand_jacobian, hand_pose, inverse_kinematics
from clutter6d.sim.robot_facts import (
    JOINT_LOWER_RAD,
    JOINT_NAMES,
    JOINT_TORQUE_NM,
    JOINT_UPPER_RAD,
    JOINT_VELOCITY_RAD_S,
)
from clutter6d.sim.robot_visual import add_visuals

__all__ = [
    "HOME_QPOS",
    "JOINT_LOWER_RAD",
    "JOINT_NAMES",
    "JOINT_TORQUE_NM",
    "JOINT_UPPER_RAD",
    "JOINT_VELOCITY_RAD_S",
    "RobotHandles",
    "add_robot",
    "end_effector_points",
    "hand_jacobian",
    "hand_pose",
    "inverse_kinematics",
]

HOME_QPOS = np.array([0.0, -0.6648, 0.0, -2.3850, 0.0, 1.7202, 0.7854])
"""Start of every episode [rad]: hand at (-0.25, 0, 0.55) pointing down, its tips 0.44 m above the table."""

STIFFNESS_NM_RAD = (600.0, 600.0, 600.0, 600.0, 110.0, 110.0, 110.0)
DAMPING_NM_S_RAD = (60.0, 65.0, 50.0, 45.0, 6.5, 7.0, 6.0)

COLLISION_RGBA = (0.35, 0.55, 0.75, 1.0)
ARM_FRICTION = (0.6, 0.005, 0.0001)
FINGER_FRICTION = (1.0, 0.005, 0.0001)

_CAPSULES = {
    4: (((0.0, 0.0, -0.06, 0.0, 0.0, 0.06), 0.063),),
    5: (((0.0, 0.0, -0.26, 0.0, 0.05, -0.20), 0.060), ((0.0, 0.07, -0.17, 0.0, 0.07, -0.03), 0.036)),
    6: (((0.0, 0.0, -0.06, 0.0, 0.0, 0.01), 0.052), ((0.04, 0.0, 0.0, 0.088, 0.0, 0.0), 0.050)),
    7: (((0.0, 0.0, 0.02, 0.0, 0.0, 0.06), 0.046),),
}
"""Per link: both ends and the radius of its collision capsules [m], in the link's frame."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotHandles:
    """Names of the robot's parts in the model.

    Attributes:
        joints: The seven joints, base to hand; the first seven of ``qpos`` when the robot is added first.
        actuators: Position actuators, in the joints' order; their controls are target angles [rad].
        bodies: The bodies, base to hand.
        hand_body: The body whose frame :func:`hand_pose` gives.
        tip_site: Between the finger tips.
        finger_sites: The left and the right finger's tip.
        collision_geoms: Every geom that can collide.
    """

    joints: tuple[str, ...]
    actuators: tuple[str, ...]
    bodies: tuple[str, ...]
    hand_body: str
    tip_site: str
    finger_sites: tuple[str, str]
    collision_geoms: tuple[str, ...]


def add_robot(spec: mujoco.MjSpec, *, visuals: bool = False) -> RobotHandles:
    """Add the robot to a specification, its base at ``(-0.60, 0, 0)`` on the world body.

    Args:
        spec: Specification whose ``compiler.degree`` is false.
        visuals: Also add visual meshes (group 2); physics does not change.

    Returns:
        The names of what was added.
    """
    spec.compiler.degree = False
    body = spec.worldbody.add_body(name="fr3_link0", pos=facts.BASE_POSITION_M)
    _set_inertia(body, facts.LINKS[0])
    bodies = [body]
    for i in range(7):
        twist = facts.JOINT_TWISTS[i]
        quat = (1.0, 0.0, 0.0, 0.0) if twist == 0 else (sqrt(0.5), twist * sqrt(0.5), 0.0, 0.0)
        body = body.add_body(name=f"fr3_link{i + 1}", pos=facts.JOINT_OFFSETS_M[i], quat=quat)
        _set_inertia(body, facts.LINKS[i + 1])
        _add_joint(spec, body, i)
        bodies.append(body)
    bodies.append(_add_hand(body))
    geoms = [name for number, item in enumerate(bodies) for name in _add_collision(item, number)]
    if visuals:
        add_visuals(spec, {item.name: item for item in bodies})
    return RobotHandles(
        joints=facts.JOINT_NAMES,
        actuators=facts.JOINT_NAMES,
        bodies=tuple(item.name for item in bodies),
        hand_body="hand",
        tip_site="hand_tip",
        finger_sites=("finger_left", "finger_right"),
        collision_geoms=tuple(geoms),
    )


def _add_joint(spec: mujoco.MjSpec, body: mujoco.MjsBody, index: int) -> None:
    name, limits = facts.JOINT_NAMES[index], (facts.JOINT_LOWER_RAD[index], facts.JOINT_UPPER_RAD[index])
    body.add_joint(
        name=name,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=(0, 0, 1),
        range=limits,
        limited=True,
        armature=facts.JOINT_ARMATURE_KG_M2[index],
        damping=facts.JOINT_DAMPING_NM_S,
    )
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_position(kp=STIFFNESS_NM_RAD[index], kv=DAMPING_NM_S_RAD[index])
    motor.ctrlrange, motor.ctrllimited = limits, True
    motor.forcerange, motor.forcelimited = (-facts.JOINT_TORQUE_NM[index], facts.JOINT_TORQUE_NM[index]), True


def _add_hand(flange: mujoco.MjsBody) -> mujoco.MjsBody:
    """The hand with both closed fingers as one rigid body."""
    half = facts.HAND_YAW_RAD / 2
    hand = flange.add_body(name="hand", pos=facts.FLANGE_OFFSET_M, quat=(cos(half), 0, 0, sin(half)))
    _set_inertia(hand, facts.HAND)
    hand.add_site(name="hand_tip", pos=(0, 0, facts.TIP_OFFSET_M))
    turns = ((1, 0, 0, 0), (0, 0, 0, 1))
    for name, quat, capsule in zip(("finger_left", "finger_right"), turns, FINGERS, strict=True):
        finger = hand.add_body(name=f"{name}_link", pos=(0, 0, facts.FINGER_OFFSET_M), quat=quat)
        _set_inertia(finger, facts.FINGER)
        hand.add_site(name=name, pos=(0, capsule.centre_m[1], facts.TIP_OFFSET_M))
    return hand


def _set_inertia(body: mujoco.MjsBody, link: facts.LinkInertia) -> None:
    body.gravcomp = 1
    body.explicitinertial = True
    body.mass, body.ipos, body.fullinertia = link.mass_kg, link.centre_m, link.inertia


def _add_collision(body: mujoco.MjsBody, number: int) -> list[str]:
    """Add the collision geoms of link ``number``; 8 is the hand."""
    names: list[str] = []
    for index, (ends, radius) in enumerate(_CAPSULES.get(number, ())):
        names.append(f"{body.name}_collision_{index}")
        _collider(body, names[-1], mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=ends, size=(radius, 0, 0))
    if number < len(facts.LINKS):
        return names
    _collider(body, "hand_collision", mujoco.mjtGeom.mjGEOM_BOX, pos=HAND_BOX.centre_m, size=HAND_BOX.half_m)
    for name, finger in zip(("finger_left_collision", "finger_right_collision"), FINGERS, strict=True):
        size = (finger.radius_m, finger.half_length_m, 0)
        _collider(body, name, mujoco.mjtGeom.mjGEOM_CAPSULE, pos=finger.centre_m, size=size, friction=FINGER_FRICTION)
    return ["hand_collision", "finger_left_collision", "finger_right_collision"]


def _collider(body: mujoco.MjsBody, name: str, shape: mujoco.mjtGeom, **options: Sequence[float | int]) -> None:
    options = {"friction": ARM_FRICTION} | options
    body.add_geom(
        name=name,
        type=shape,
        contype=ROBOT_CONTACT[0],
        conaffinity=ROBOT_CONTACT[1],
        group=COLLISION_GROUP,
        rgba=COLLISION_RGBA,
        mass=0.0,
        **options,
    )
