"""The robot as an articulation of a USD stage, read from the compiled MuJoCo model so that both are the same robot.

{path}                   articulation root
{path}/LINK              one rigid body for each body of the robot, side by side, posed at home
{path}/LINK/visual       what renderers show
{path}/LINK/collision    its colliders, purpose guide
{path}/joints            a fixed joint to the world, seven driven revolute joints, fixed joints to hand and fingers
{path}/no_self_contact   collision group: the robot does not touch itself
"""

from math import pi
from typing import Any

import mujoco
import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from clutter6d.export.fixtures import fixtures, geom_colour, geom_mesh, geoms_of, robot_bodies
from clutter6d.export.usd_prims import (
    add_vendor_schema,
    bind_look,
    define_colour,
    define_friction,
    define_mesh,
    hide_from_renderers,
    make_collider,
    make_rigid_body,
    place,
)
from clutter6d.geometry import quat_to_matrix
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.robot_facts import JOINT_VELOCITY_RAD_S

_FLOAT, _BOOL = Sdf.ValueTypeNames.Float, Sdf.ValueTypeNames.Bool
_PER_DEGREE = pi / 180


def define_robot(stage: Usd.Stage, path: Sdf.Path) -> UsdGeom.Xform:
    """Define the robot with its base fixed where the simulator has it.

    Args:
        stage: The stage to define it on.
        path: Of the articulation.
    """
    robot = UsdGeom.Xform.Define(stage, path)
    Usd.ModelAPI(robot.GetPrim()).SetKind("component")
    UsdPhysics.ArticulationRootAPI.Apply(robot.GetPrim())
    add_vendor_schema(
        robot.GetPrim(), "PhysxArticulationAPI", {"physxArticulation:enabledSelfCollisions": (_BOOL, False)}
    )
    model, data = fixtures()
    materials = _Materials(stage, path.AppendChild("materials"))
    UsdGeom.Scope.Define(stage, path.AppendChild("joints"))
    for body in robot_bodies(model):
        _define_link(stage, path, model, data, body, materials)
    for body in robot_bodies(model):
        _define_joint(stage, path, model, body)
    group = UsdPhysics.CollisionGroup.Define(stage, path.AppendChild("no_self_contact"))
    group.GetCollidersCollectionAPI().CreateIncludesRel().AddTarget(path)
    group.CreateFilteredGroupsRel().AddTarget(group.GetPath())
    return robot


class _Materials:
    """Colours and physics materials of the robot, each defined when first asked for."""

    def __init__(self, stage: Usd.Stage, path: Sdf.Path) -> None:
        self._stage, self._path = stage, path
        self._known: dict[object, UsdShade.Material] = {}
        UsdGeom.Scope.Define(stage, path)

    def friction(self, value: float) -> UsdShade.Material:
        if value not in self._known:
            path = self._path.AppendChild(f"friction_{len(self._known)}")
            self._known[value] = define_friction(self._stage, path, value)
        return self._known[value]

    def colour(self, rgba: tuple[float, float, float, float]) -> UsdShade.Material:
        if rgba not in self._known:
            path = self._path.AppendChild(f"colour_{len(self._known)}")
            self._known[rgba] = define_colour(self._stage, path, rgba)
        return self._known[rgba]


def _define_link(
    stage: Usd.Stage, robot: Sdf.Path, model: mujoco.MjModel, data: mujoco.MjData, body: int, materials: _Materials
) -> None:
    path = robot.AppendChild(model.body(body).name)
    link = UsdGeom.Xform.Define(stage, path)
    place(link, data.xpos[body], data.xquat[body])
    axes = quat_to_matrix(model.body_iquat[body])
    inertia = axes @ np.diag(model.body_inertia[body]) @ axes.T
    make_rigid_body(link.GetPrim(), float(model.body_mass[body]), model.body_ipos[body], inertia)
    # The arm's own controller carries its weight, as gravcomp does in the MJCF.
    add_vendor_schema(link.GetPrim(), "PhysxRigidBodyAPI", {"physxRigidBody:disableGravity": (_BOOL, True)})
    _define_shapes(stage, path, model, body, materials)


def _define_shapes(stage: Usd.Stage, link: Sdf.Path, model: mujoco.MjModel, body: int, materials: _Materials) -> None:
    for kind, collides in (("visual", False), ("collision", True)):
        geoms = geoms_of(model, body, colliding=collides)
        if not geoms:
            continue
        below = UsdGeom.Xform.Define(stage, link.AppendChild(kind))
        if collides:
            hide_from_renderers(below.GetPrim())
        for index, geom in enumerate(geoms):
            prim = _define_geom(stage, below.GetPath().AppendChild(f"shape_{index}"), model, geom)
            if collides:
                make_collider(prim, materials.friction(float(model.geom_friction[geom, 0])))
            else:
                bind_look(prim, materials.colour(geom_colour(model, geom)))


def _define_geom(stage: Usd.Stage, path: Sdf.Path, model: mujoco.MjModel, geom: int) -> Usd.Prim:
    size = model.geom_size[geom]
    match model.geom_type[geom]:
        case mujoco.mjtGeom.mjGEOM_CAPSULE:
            shape: Any = UsdGeom.Capsule.Define(stage, path)
            shape.CreateRadiusAttr(float(size[0]))
            shape.CreateHeightAttr(2 * float(size[1]))
            shape.CreateAxisAttr(UsdGeom.Tokens.z)
            reach = np.array([size[0], size[0], size[0] + size[1]], dtype=np.float32)
            shape.CreateExtentAttr(np.stack([-reach, reach]))
        case mujoco.mjtGeom.mjGEOM_BOX:
            shape = define_box(stage, path)
        case _:
            shape = define_mesh(stage, path, *geom_mesh(model, geom))
    place(shape, model.geom_pos[geom], model.geom_quat[geom])
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        shape.AddScaleOp().Set(Gf.Vec3f(*(2 * float(half) for half in size)))
    return shape.GetPrim()


def define_box(stage: Usd.Stage, path: Sdf.Path) -> UsdGeom.Cube:
    """Define a cube of side 1, to be placed and then scaled."""
    box = UsdGeom.Cube.Define(stage, path)
    box.CreateSizeAttr(1.0)
    box.CreateExtentAttr(np.array([[-0.5] * 3, [0.5] * 3], dtype=np.float32))
    return box


def _define_joint(stage: Usd.Stage, robot: Sdf.Path, model: mujoco.MjModel, body: int) -> None:
    """Define the joint that holds a link: to its parent, or the base to the robot's own frame, which is static."""
    name, joints = model.body(body).name, robot.AppendChild("joints")
    parent = model.body_parentid[body]
    holder = robot if parent == 0 else robot.AppendChild(model.body(parent).name)
    if model.body_jntnum[body]:
        index = int(model.body_jntadr[body])
        joint: Any = UsdPhysics.RevoluteJoint.Define(stage, joints.AppendChild(model.joint(index).name))
        _set_up_drive(joint, model, index)
    else:
        joint = UsdPhysics.FixedJoint.Define(stage, joints.AppendChild(f"{name}_fixed"))
    joint.CreateBody0Rel().SetTargets([holder])
    joint.CreateBody1Rel().SetTargets([robot.AppendChild(name)])
    w, x, y, z = (float(value) for value in model.body_quat[body])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*map(float, model.body_pos[body])))
    joint.CreateLocalRot0Attr(Gf.Quatf(w, x, y, z))
    joint.CreateLocalPos1Attr(Gf.Vec3f(0.0))
    joint.CreateLocalRot1Attr(Gf.Quatf(1.0))


def _set_up_drive(joint: UsdPhysics.RevoluteJoint, model: mujoco.MjModel, index: int) -> None:
    """Limits and position control; USD has them in degrees and newton metres per degree."""
    lower, upper = np.rad2deg(model.jnt_range[index])
    joint.CreateAxisAttr(UsdPhysics.Tokens.z)
    joint.CreateLowerLimitAttr(float(lower))
    joint.CreateUpperLimitAttr(float(upper))
    drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), UsdPhysics.Tokens.angular)
    drive.CreateTypeAttr(UsdPhysics.Tokens.force)
    drive.CreateMaxForceAttr(float(model.actuator_forcerange[index, 1]))
    drive.CreateStiffnessAttr(float(model.actuator_gainprm[index, 0]) * _PER_DEGREE)
    damping = -float(model.actuator_biasprm[index, 2]) + float(model.dof_damping[index])
    drive.CreateDampingAttr(damping * _PER_DEGREE)
    drive.CreateTargetPositionAttr(float(np.rad2deg(HOME_QPOS[index])))
    speed = float(np.rad2deg(JOINT_VELOCITY_RAD_S[index]))
    values = {
        "physxJoint:armature": (_FLOAT, float(model.dof_armature[index])),
        "physxJoint:maxJointVelocity": (_FLOAT, speed),
    }
    add_vendor_schema(joint.GetPrim(), "PhysxJointAPI", values)
    state = {"state:angular:physics:position": (_FLOAT, float(np.rad2deg(HOME_QPOS[index])))}
    add_vendor_schema(joint.GetPrim(), "PhysicsJointStateAPI:angular", state)
