"""Loads exported scenes into Newton, another engine, and measures whether they stand still.

    pip install "clutter6d[newton]"
    python examples/check_usd_in_newton.py SCENES_OR_SPLIT [--limit N] [--out drift.csv]

Each scene is exported to MJCF and USD. What USD's validators report and the largest difference of the two files is
noted (check_usd_parity.py). Then both are simulated for 1 s from goal pair 0: the MJCF by plain MuJoCo at its step of
5 ms, the USD by Newton's own importer, collision detection and Steel solver (projected Gauss-Seidel), on the CPU, at
2.5 ms. The robot takes part, held by its drives; Newton does not compensate its gravity, so it sags a little, high
above the objects. Drift is the largest seen in ten looks at the worst object.

Newton compiles its kernels when it is first used, which takes about a minute. One row a scene is added to the CSV as
soon as it is measured, so that the same command goes on after an interruption.
Exits with 1 if a validator reports something, parity is worse than 1e-6, or an object moves over 1 mm or 1 degree.
"""

import argparse
import csv
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from check_usd_drift import Motion, watch_mujoco, watch_newton
from check_usd_parity import LIMIT, compare, validator_reports
from rich.progress import Progress

from clutter6d.dataset.scenes import SceneCollection, find_scenes
from clutter6d.errors import Clutter6DError, InvalidFileError
from clutter6d.export.mjcf import export_mjcf
from clutter6d.export.usd import export_usd
from clutter6d.scene import Scene

AT_ONCE = 16
DRIFT_MM, DRIFT_DEG = 1.0, 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Row:
    """What was found for one scene.

    Attributes:
        scene_id: The scene.
        scenes_sha256: The beginning of the hash of the scenes it belongs to; rows of other scenes are not taken over.
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
    scenes_sha256: str
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


KINDS: dict[str, Any] = {field.name: field.type for field in fields(Row)}


def check_scenes(scenes: Sequence[Scene], collection: SceneCollection) -> Iterator[Row]:
    """Export some scenes of a collection and measure them; a row each."""
    with tempfile.TemporaryDirectory() as scratch:
        folders = [Path(scratch) / scene.scene_id for scene in scenes]
        owned = [(scene, collection.assets_of(scene)) for scene in scenes]
        files = [
            (export_mjcf(scene, assets, folder), export_usd(scene, assets, folder))
            for (scene, assets), folder in zip(owned, folders, strict=True)
        ]
        motions = watch_newton([usd for _, usd in files])
        for scene, (mjcf, usd), in_newton in zip(scenes, files, motions, strict=True):
            yield make_row(scene, short_hash(collection), mjcf, usd, in_newton)


def make_row(scene: Scene, scenes_sha256: str, mjcf: Path, usd: Path, newton_all: Motion) -> Row:
    """Everything that is found for one scene."""
    mujoco_all = watch_mujoco(mjcf)
    objects = [item.name for item in scene.objects]
    in_newton, in_mujoco = newton_all.of(objects), mujoco_all.of(objects)
    same = mujoco_all.of(newton_all.names)
    return Row(
        scene_id=scene.scene_id,
        scenes_sha256=scenes_sha256,
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


def short_hash(collection: SceneCollection) -> str:
    """Names a collection."""
    return collection.sha256[:12]


def read_rows(path: Path) -> list[Row]:
    """The rows of a CSV so far; a last line cut short by an interruption is removed from the file."""
    if not path.exists():
        return []
    text = path.read_text()
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        path.write_text(whole)
    try:
        table = csv.DictReader(whole.splitlines())
        return [Row(**{name: KINDS[name](value) for name, value in row.items()}) for row in table]
    except (KeyError, TypeError, ValueError):
        raise InvalidFileError(path, "holds another table; choose another --out") from None


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
    done = {row.scene_id: row for row in read_rows(out) if row.scenes_sha256 == short_hash(collection)}
    missing = [scene for scene in wanted if scene.scene_id not in done]
    with Progress(*Progress.get_default_columns()) as progress:
        bar = progress.add_task("scenes", total=len(wanted), completed=len(wanted) - len(missing))
        for first in range(0, len(missing), AT_ONCE):
            for row in check_scenes(missing[first : first + AT_ONCE], collection):
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


def positive(text: str) -> int:
    """A number of scenes, as argparse reads it."""
    if not text.isdecimal() or int(text) == 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of scenes")
    return int(text)


def main() -> int:
    """Check the scenes that the command line names; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", help="a folder of scenes, or the name of a frozen split")
    parser.add_argument("--limit", type=positive, help="check at most so many scenes")
    parser.add_argument("--out", type=Path, default=Path("drift.csv"), help="CSV of the rows; continued if it exists")
    chosen = parser.parse_args()
    try:
        rows = measure(chosen.scenes, chosen.limit, chosen.out)
    except Clutter6DError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    print_summary(rows)
    return 0 if all(row.is_good() for row in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
