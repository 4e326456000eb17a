"""Loads exported scenes into Newton, an engine that shares no code with MuJoCo, and measures whether they stand still.

    pip install "clutter6d[newton]"
    python examples/check_usd_in_newton.py SCENES_OR_SPLIT [--limit N] [--out drift.csv]

Each scene is exported to MJCF and USD. What USD's validators report and the largest difference of the two files is
noted (check_usd_parity.py). Then both are simulated for 1 s from goal pair 0: the MJCF by plain MuJoCo at its step of
5 ms, the USD by Newton's own importer, collision detection and Steel solver (projected Gauss-Seidel), on the CPU, at
2.5 ms. The robot takes part, held by its drives; Newton does not compensate its gravity, so it sags a little, high
above the objects. Drift is the largest seen in ten looks at the worst object.

One row a scene is added to the CSV as soon as it is measured, so that the same command goes on after an interruption.
Exits with 1 if a validator reports something, parity is worse than 1e-6, or an object moves over 1 mm or 1 degree.
"""

import argparse
import csv
import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from check_usd_parity import LIMIT, compare, validator_reports
from rich.progress import Progress

from clutter6d.assets.asset import Asset
from clutter6d.dataset.scenes import find_scenes
from clutter6d.export.mjcf import export_mjcf
from clutter6d.export.usd import export_usd
from clutter6d.scene import Scene

SECOND, LOOKS = 1.0, 10
NEWTON_STEP_S = 0.0025
CONTACT_GAP_M = 0.005
MAX_CONTACT_ROWS = 4096
AT_ONCE = 16
DRIFT_MM, DRIFT_DEG = 1.0, 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Row:
    """What was found for one scene.

    Attributes:
        scene_id: The scene.
        objects: Number of objects.
        validator_reports: What USD's validators reported; 0 is silence.
        parity: Largest relative difference of MJCF and USD.
        start_mm: Largest distance between where Newton and MuJoCo have a body after loading, robot included.
        newton_mm: Largest drift of an object's position in Newton within 1 s.
        newton_deg: Largest rotation of an object in Newton within 1 s.
        newton_object: The object that moved most in Newton.
        mujoco_mm: Largest drift in MuJoCo.
        mujoco_deg: Largest rotation in MuJoCo.
    """

    scene_id: str
    objects: int
    validator_reports: int
    parity: float
    start_mm: float
    newton_mm: float
    newton_deg: float
    newton_object: str
    mujoco_mm: float
    mujoco_deg: float

    def is_good(self) -> bool:
        """Whether every limit is kept."""
        drift = max(self.newton_mm, self.mujoco_mm) / DRIFT_MM, max(self.newton_deg, self.mujoco_deg) / DRIFT_DEG
        return self.validator_reports == 0 and self.parity <= LIMIT and self.start_mm <= 1e-2 and max(drift) <= 1


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
        names.append([path.rpartition("/")[2] for path in sorted(bodies, key=bodies.get)])
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


def import_newton() -> Any:
    """Newton, without its greeting; a missing package ends in one line."""
    try:
        import warp

        warp.config.quiet = True
        warp.config.enable_backward = False  # gradients would take most of the time of compiling
        import newton
        import newton.usd
        import newton_usd_schemas  # noqa: F401
    except ImportError as error:
        sys.exit(f'error: {error.name} is not installed; run: pip install "clutter6d[newton]"')
    return newton


def check_scenes(scenes: Sequence[Scene], assets_of: Callable[[Scene], Mapping[str, Asset]]) -> Iterator[Row]:
    """Export some scenes and measure them; a row each."""
    with tempfile.TemporaryDirectory() as scratch:
        folders = [Path(scratch) / scene.scene_id for scene in scenes]
        files = [
            (export_mjcf(scene, assets_of(scene), folder), export_usd(scene, assets_of(scene), folder))
            for scene, folder in zip(scenes, folders, strict=True)
        ]
        motions = watch_newton([usd for _, usd in files])
        for scene, (mjcf, usd), in_newton in zip(scenes, files, motions, strict=True):
            yield make_row(scene, mjcf, usd, in_newton)


def make_row(scene: Scene, mjcf: Path, usd: Path, newton_all: Motion) -> Row:
    """Everything that is found for one scene."""
    mujoco_all = watch_mujoco(mjcf)
    objects = [item.name for item in scene.objects]
    in_newton, in_mujoco = newton_all.of(objects), mujoco_all.of(objects)
    same = mujoco_all.of(newton_all.names)
    return Row(
        scene_id=scene.scene_id,
        objects=len(objects),
        validator_reports=len(validator_reports(usd)),
        parity=max(compare(mjcf, usd).values()),
        start_mm=1000 * float(np.linalg.norm(newton_all.start[:, :3] - same.start[:, :3], axis=1).max()),
        newton_mm=float(in_newton.mm.max()),
        newton_deg=float(in_newton.deg.max()),
        newton_object=objects[int(in_newton.mm.argmax())],
        mujoco_mm=float(in_mujoco.mm.max()),
        mujoco_deg=float(in_mujoco.deg.max()),
    )


def read_rows(path: Path) -> list[Row]:
    """The rows of a CSV so far; a last line cut short by an interruption is removed from the file."""
    if not path.exists():
        return []
    text = path.read_text()
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole)
    kinds = {field.name: field.type for field in fields(Row)}
    return [
        Row(**{name: kinds[name](value) for name, value in row.items()}) for row in csv.DictReader(whole.splitlines())
    ]


def add_row(path: Path, row: Row) -> None:
    """Append a row, safely on disk when this returns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, list(asdict(row)), lineterminator="\n")
        if file.tell() == 0:
            writer.writeheader()
        values = {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in asdict(row).items()}
        writer.writerow(values)
        file.flush()
        os.fsync(file.fileno())


def measure(where: str, limit: int | None, out: Path) -> list[Row]:
    """Rows of all scenes: those in the CSV already, and those measured now."""
    collection, scenes = find_scenes(where)
    wanted = list(scenes)[:limit]
    done = {row.scene_id: row for row in read_rows(out)}
    missing = [scene for scene in wanted if scene.scene_id not in done]
    with Progress(*Progress.get_default_columns()) as progress:
        bar = progress.add_task("scenes", total=len(wanted), completed=len(wanted) - len(missing))
        for first in range(0, len(missing), AT_ONCE):
            for row in check_scenes(missing[first : first + AT_ONCE], collection.assets_of):
                add_row(out, row)
                done[row.scene_id] = row
                progress.advance(bar)
    return [done[scene.scene_id] for scene in wanted]


def print_summary(rows: Sequence[Row]) -> None:
    """A line a scene, and the worst and the median of all."""
    print(f"{'scene':22} reports  parity  Newton mm   deg  MuJoCo mm   deg  moved most in Newton")
    for row in rows:
        found = f"{row.validator_reports:7d} {row.parity:7.0e} {row.newton_mm:10.3f} {row.newton_deg:5.3f}"
        print(f"{row.scene_id:22} {found} {row.mujoco_mm:10.3f} {row.mujoco_deg:5.3f}  {row.newton_object}")
    for name, reduce in (("worst", np.max), ("median", np.median)):
        columns = ("parity", "newton_mm", "newton_deg", "mujoco_mm", "mujoco_deg")
        found = [float(reduce([getattr(row, column) for row in rows])) for column in columns]
        print(f"{name:30} {found[0]:7.0e} {found[1]:10.3f} {found[2]:5.3f} {found[3]:10.3f} {found[4]:5.3f}")
    good = sum(row.is_good() for row in rows)
    print(f"{good} of {len(rows)} scenes: validators silent, MJCF and USD equal, still in both engines")


def main() -> int:
    """Check the scenes that the command line names; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", help="a folder of scenes, or the name of a frozen split")
    parser.add_argument("--limit", type=int, help="check at most so many scenes")
    parser.add_argument("--out", type=Path, default=Path("drift.csv"), help="CSV of the rows; continued if it exists")
    chosen = parser.parse_args()
    rows = measure(chosen.scenes, chosen.limit, chosen.out)
    print_summary(rows)
    return 0 if rows and all(row.is_good() for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
