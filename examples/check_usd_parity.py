"""Compares a scene's MJCF and USD as others read them: plain MuJoCo, plain OpenUSD, none of our code.

    clutter6d export scenes --format mjcf,usd --out exported
    python examples/check_usd_parity.py exported/mjcf/sparse-0-00000/scene.xml exported/usd/sparse-0-00000/scene.usd

For every object and every link of the robot: mass, centre of mass, inertia (as a full tensor), convex parts and their
corners, friction; poses at every goal pair; joint frames, limits and drives; and what USD's own validators report.
Errors are relative to the size of what is compared. Exits with 1 if one exceeds 1e-6 or a validator reports anything.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade, UsdValidation
from scipy.spatial.transform import Rotation

LIMIT = 1e-6
OBJECTS, ROBOT, GOAL = "/World/objects", "/World/robot", "/World/goal"


def validator_reports(path: Path) -> list[str]:
    """What any of USD's validators (core, geometry, shading, physics, packages) has to say of a file."""
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    stage = Usd.Stage.Open(str(path))
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    return [" ".join(f"{report.GetName()}: {report.GetErrorAsString()}".split()) for report in found]


def compare(mjcf: Path, usd: Path) -> dict[str, float]:
    """The largest relative error of each quantity."""
    model, stage = mujoco.MjModel.from_xml_path(str(mjcf)), Usd.Stage.Open(str(usd))
    worst: dict[str, float] = {}
    for quantity, wanted, got in _quantities(model, stage):
        worst[quantity] = max(worst.get(quantity, 0.0), relative_error(wanted, got))
    return worst


def relative_error(wanted: np.ndarray, got: np.ndarray) -> float:
    """Largest difference over the size of what is wanted; infinite if there are more or fewer of them."""
    wanted, got = np.asarray(wanted, dtype=np.float64), np.asarray(got, dtype=np.float64)
    if wanted.shape != got.shape or not np.isfinite(got).all():
        return np.inf
    difference = float(np.abs(wanted - got).max(initial=0.0))
    return difference / max(float(np.linalg.norm(wanted)), 1e-12) if difference else 0.0


def _quantities(model: mujoco.MjModel, stage: Usd.Stage) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    objects, links = _children(stage, OBJECTS), _bodies(stage, ROBOT)
    free = [model.body(model.jnt_bodyid[joint]).name for joint in _joints(model, mujoco.mjtJoint.mjJNT_FREE)]
    yield "objects", np.array(len(free)), np.array(sum(name in free for name in objects))
    yield "links", np.array(model.nbody - 2 - len(free)), np.array(len(links))
    yield "gravity", model.opt.gravity, _gravity(stage)
    for name, prim in (objects | links).items():
        yield from _body_quantities(model, name, prim)
    yield from _collider_quantities(model, 0, stage.GetPrimAtPath("/World/table"))
    yield from _pose_quantities(model, stage, objects, links)
    for joint in _joints(model, mujoco.mjtJoint.mjJNT_HINGE):
        yield from _joint_quantities(model, stage, joint)


def _body_quantities(model: mujoco.MjModel, name: str, prim: Usd.Prim) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    body, mass = model.body(name), UsdPhysics.MassAPI(prim)
    yield "mass", body.mass, np.array([mass.GetMassAttr().Get()])
    yield "centre of mass", body.ipos, np.array(mass.GetCenterOfMassAttr().Get())
    axes = mass.GetPrincipalAxesAttr().Get()
    yield (
        "inertia",
        _tensor(body.inertia, body.iquat),
        _tensor(np.array(mass.GetDiagonalInertiaAttr().Get()), _wxyz(axes)),
    )
    yield from _collider_quantities(model, body.id, prim)


def _collider_quantities(
    model: mujoco.MjModel, body: int, prim: Usd.Prim
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    start = model.body_geomadr[body]
    geoms = [geom for geom in range(start, start + model.body_geomnum[body]) if model.geom_contype[geom]]
    shapes = [item for item in Usd.PrimRange(prim) if item.HasAPI(UsdPhysics.CollisionAPI)]
    yield "colliders", np.array(len(geoms)), np.array(len(shapes))
    for geom, shape in zip(geoms, shapes, strict=False):
        material = UsdShade.MaterialBindingAPI(shape).ComputeBoundMaterial("physics")[0]
        friction = UsdPhysics.MaterialAPI(material)
        got = [friction.GetStaticFrictionAttr().Get(), friction.GetDynamicFrictionAttr().Get()]
        yield "friction", np.full(2, model.geom_friction[geom, 0]), np.array(got)
        yield "collider corners", _geom_corners(model, geom), _shape_corners(shape, prim)


def _pose_quantities(
    model: mujoco.MjModel, stage: Usd.Stage, objects: dict[str, Usd.Prim], links: dict[str, Usd.Prim]
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    stage.SetEditTarget(stage.GetSessionLayer())
    variants = stage.GetDefaultPrim().GetVariantSet("goal_pair")
    yield "goal pairs", np.array(model.nkey), np.array(len(variants.GetVariantNames()))
    data = mujoco.MjData(model)
    for key in range(model.nkey):
        mujoco.mj_resetDataKeyframe(model, data, key)
        mujoco.mj_kinematics(model, data)
        if not variants.SetVariantSelection(model.key(key).name):
            yield "goal pairs", np.array(1), np.array(0)
            continue
        for name, prim in (objects | links | {"goal": stage.GetPrimAtPath(GOAL)}).items():
            position, rotation = _world_pose(prim)
            yield "positions", data.body(name).xpos, position
            yield "orientations", data.body(name).xmat.reshape(3, 3), rotation


def _joint_quantities(
    model: mujoco.MjModel, stage: Usd.Stage, joint: int
) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    prim = stage.GetPrimAtPath(f"{ROBOT}/joints/{model.joint(joint).name}")
    revolute, drive = UsdPhysics.RevoluteJoint(prim), UsdPhysics.DriveAPI(prim, "angular")
    body = model.jnt_bodyid[joint]
    limits = [revolute.GetLowerLimitAttr().Get(), revolute.GetUpperLimitAttr().Get()]
    yield "joint limits", model.jnt_range[joint], np.deg2rad(limits)
    yield "joint frames", model.body_pos[body], np.array(revolute.GetLocalPos0Attr().Get())
    frame = _wxyz(revolute.GetLocalRot0Attr().Get())
    yield "joint frames", _matrix(model.body_quat[body]), _matrix(frame)
    damping = model.dof_damping[joint] - model.actuator_biasprm[joint, 2]
    wanted = [model.actuator_gainprm[joint, 0], damping]
    got = [drive.GetStiffnessAttr().Get(), drive.GetDampingAttr().Get()]
    yield "drives", np.array(wanted), np.rad2deg(got)
    yield "drives", model.actuator_forcerange[joint, 1:], np.array([drive.GetMaxForceAttr().Get()])


def _joints(model: mujoco.MjModel, kind: mujoco.mjtJoint) -> list[int]:
    return [joint for joint in range(model.njnt) if model.jnt_type[joint] == kind]


def _children(stage: Usd.Stage, path: str) -> dict[str, Usd.Prim]:
    """Prims below a path, by the name that the scene has for them."""
    found = stage.GetPrimAtPath(path).GetChildren()
    return {prim.GetCustomDataByKey("clutter6d:name"): prim for prim in found}


def _bodies(stage: Usd.Stage, path: str) -> dict[str, Usd.Prim]:
    found = stage.GetPrimAtPath(path).GetChildren()
    return {prim.GetName(): prim for prim in found if prim.HasAPI(UsdPhysics.RigidBodyAPI)}


def _gravity(stage: Usd.Stage) -> np.ndarray:
    scene = next(UsdPhysics.Scene(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Scene))
    return np.array(scene.GetGravityDirectionAttr().Get()) * scene.GetGravityMagnitudeAttr().Get()


def _wxyz(quat: Any) -> np.ndarray:
    return np.array([quat.GetReal(), *quat.GetImaginary()])


def _matrix(quat_wxyz: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(quat_wxyz, scalar_first=True).as_matrix()


def _tensor(moments: np.ndarray, quat_wxyz: np.ndarray) -> np.ndarray:
    axes = _matrix(quat_wxyz)
    return axes @ np.diag(moments) @ axes.T


def _world_pose(prim: Usd.Prim) -> tuple[np.ndarray, np.ndarray]:
    transform = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
    return transform[3, :3], transform[:3, :3].T


def _geom_corners(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Corners of a geom's bounding box in its body's frame; of a mesh, its own lowest and highest corner."""
    rotation, position = _matrix(model.geom_quat[geom]), model.geom_pos[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(model.geom_dataid[geom])
        points = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]].astype(np.float64)
        return _bounds(points @ rotation.T + position)
    half = model.geom_size[geom].copy()
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
        half = np.array([half[0], half[0], half[0] + half[1]])
    return _box_corners(half) @ rotation.T + position


def _shape_corners(shape: Usd.Prim, body: Usd.Prim) -> np.ndarray:
    cache = UsdGeom.XformCache()
    transform = np.array(cache.ComputeRelativeTransform(shape, body)[0])
    if shape.IsA(UsdGeom.Mesh):
        points = np.array(UsdGeom.Mesh(shape).GetPointsAttr().Get(), dtype=np.float64)
        return _bounds(points @ transform[:3, :3] + transform[3, :3])
    if shape.IsA(UsdGeom.Cube):
        half = np.full(3, UsdGeom.Cube(shape).GetSizeAttr().Get() / 2)
    else:
        capsule = UsdGeom.Capsule(shape)
        radius = capsule.GetRadiusAttr().Get()
        half = np.array([radius, radius, radius + capsule.GetHeightAttr().Get() / 2])
    return _box_corners(half) @ transform[:3, :3] + transform[3, :3]


def _bounds(points: np.ndarray) -> np.ndarray:
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _box_corners(half: np.ndarray) -> np.ndarray:
    signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    return signs * half


def main(mjcf: Path, usd: Path) -> int:
    """Compare two files and print a table; returns the exit code."""
    errors, reports = compare(mjcf, usd), validator_reports(usd)
    for quantity, error in errors.items():
        print(f"{quantity:18} {error:.1e}")
    for report in reports:
        print(report)
    is_good = not reports and max(errors.values()) <= LIMIT
    print("equal, and valid USD" if is_good else "NOT equal, or not valid USD")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
