"""How far the bodies of an exported scene move within 1 s: its MJCF in plain MuJoCo, its USD in Newton.

Used by check_usd_in_newton.py; none of our code is needed here.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from pxr import Usd

SECOND, LOOKS = 1.0, 10
NEWTON_STEP_S = 0.0025
CONTACT_GAP_M = 0.005
MAX_CONTACT_ROWS = 4096


@dataclass(frozen=True, kw_only=True, slots=True)
class Motion:
    """Poses of named bodies at the start, and the largest drift of each.

    Attributes:
        start: Position and quaternion ``xyzw`` of every body at the start (body, 7).
        mm: Largest distance from the start (body,).
        deg: Largest angle from the start (body,).
    """

    names: list[str]
    start: np.ndarray
    mm: np.ndarray
    deg: np.ndarray

    def of(self, names: Sequence[str]) -> "Motion":
        """The same for the bodies of some names."""
        rows = [self.names.index(name) for name in names]
        return Motion(names=list(names), start=self.start[rows], mm=self.mm[rows], deg=self.deg[rows])

    def part(self, rows: slice) -> "Motion":
        """The same for some bodies in a row."""
        return Motion(names=self.names[rows], start=self.start[rows], mm=self.mm[rows], deg=self.deg[rows])


def watch(names: list[str], poses: Callable[[], np.ndarray], advance: Callable[[], None]) -> Motion:
    """Advance ten times a tenth of a second, and keep the largest drift of every body."""
    start = poses()
    mm, deg = np.zeros(len(names)), np.zeros(len(names))
    for _ in range(LOOKS):
        advance()
        now = poses()
        mm = np.fmax(mm, 1000 * np.linalg.norm(now[:, :3] - start[:, :3], axis=1))
        deg = np.fmax(deg, angle_deg(start[:, 3:], now[:, 3:]))
        mm[~np.isfinite(now).all(axis=1)] = np.inf
    return Motion(names=names, start=start, mm=mm, deg=deg)


def angle_deg(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle between unit quaternions, ``xyzw``, exact for small angles."""
    vector = a[:, 3:] * b[:, :3] - b[:, 3:] * a[:, :3] - np.cross(a[:, :3], b[:, :3])
    return np.rad2deg(2 * np.arctan2(np.linalg.norm(vector, axis=1), np.abs((a * b).sum(axis=1))))


def watch_mujoco(mjcf: Path) -> Motion:
    """One second of the MJCF in plain MuJoCo."""
    model = mujoco.MjModel.from_xml_path(str(mjcf))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("pair_0").id)
    mujoco.mj_kinematics(model, data)
    names = [model.body(body).name for body in range(model.nbody)]

    def poses() -> np.ndarray:
        mujoco.mj_kinematics(model, data)
        return np.concatenate([data.xpos, np.roll(data.xquat, -1, axis=1)], axis=1)

    steps = round(SECOND / LOOKS / model.opt.timestep)
    return watch(names, poses, lambda: mujoco.mj_step(model, data, steps))


def watch_newton(scenes: Sequence[Path]) -> list[Motion]:
    """One second of some scenes' USD in Newton: side by side, each in a world of its own, which saves time."""
    newton = import_newton()
    builder = newton.ModelBuilder()
    names: list[list[str]] = []
    for usd in scenes:
        world = newton.ModelBuilder()
        resolvers = [newton.usd.SchemaResolverNewton(), newton.usd.SchemaResolverPhysx()]
        bodies = world.add_usd(str(usd), load_visual_shapes=False, schema_resolvers=resolvers)["path_body_map"]
        names.append(body_names(usd, sorted(bodies, key=bodies.get)))
        world.shape_gap[:] = [CONTACT_GAP_M] * len(world.shape_gap)
        builder.add_world(world)
    model = builder.finalize(device="cpu")
    rows = {"free_body_constraint_max": MAX_CONTACT_ROWS, "articulation_constraint_max": 256}
    solver, pipeline = newton.solvers.SolverSteel(model, **rows), newton.CollisionPipeline(model)
    contacts, control = pipeline.contacts(), model.control()
    states = [model.state(), model.state()]
    newton.eval_fk(model, model.joint_q, model.joint_qd, states[0])

    def advance() -> None:
        for _ in range(round(SECOND / LOOKS / NEWTON_STEP_S)):
            pipeline.collide(states[0], contacts)
            states[0].clear_forces()
            solver.step(states[0], states[1], control, contacts, NEWTON_STEP_S)
            states.reverse()

    everything = [name for found in names for name in found]
    motion = watch(everything, lambda: states[0].body_q.numpy().astype(np.float64), advance)
    ends = np.cumsum([len(found) for found in names])
    return [motion.part(slice(end - len(found), end)) for found, end in zip(names, ends, strict=True)]


def body_names(usd: Path, paths: Sequence[str]) -> list[str]:
    """Names of bodies as the scene has them, from the paths of their prims."""
    stage = Usd.Stage.Open(str(usd))
    prims = [stage.GetPrimAtPath(path) for path in paths]
    return [prim.GetCustomDataByKey("clutter6d:name") or prim.GetName() for prim in prims]


def import_newton() -> Any:
    """Newton, without its greeting; a missing package ends in one line."""
    try:
        import warp

        warp.config.log_level = warp.LOG_ERROR
        warp.config.enable_backward = False  # gradients would take most of the time of compiling
        import newton
        import newton.usd
        import newton_usd_schemas  # noqa: F401
    except ImportError as error:
        sys.exit(f'error: {error.name} is not installed; run: pip install "clutter6d[newton]"')
    return newton
