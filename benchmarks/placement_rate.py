"""Placements per second without physics: ours against scene_synthesizer's, same objects, same table, one core.

Ours draws a scene graph and places the objects so that it holds, each in a resting orientation, within the track's
clutter region; then once more with 16 pairs of free start and goal poses for the target. The peer scatters the same
eight objects over the whole table, turned about the vertical only, without relations, resting orientations or goals:
once colliding their meshes, and once their convex hulls, which is the least work it can be given. Not counted are
imports, reading the objects, and the peer's empty table with its support surface. The peer lives in an environment of
its own, made in the cache folder:

    python benchmarks/placement_rate.py [--scenes 40] [--rounds 3] [--peer-python PYTHON] [--library procedural]
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import trimesh
from machine import processor_name
from peer_environments import PROGRAMS, peer_python

from clutter6d.assets.asset import Asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.named_libraries import open_library
from clutter6d.geometry import rotate
from clutter6d.scene import TABLE_SIZE_M
from clutter6d.scenegen.footprint import Layout, hull_points
from clutter6d.scenegen.generator_config import GeneratorConfig
from clutter6d.scenegen.goal_pairs import TargetPoses, find_target_poses, pair_up
from clutter6d.scenegen.placement import PlacementSearch
from clutter6d.scenegen.scene_graphs import draw_scene_graph
from clutter6d.scenegen.track import find_track
from clutter6d.seeding import generator

PEER = "scene-synthesizer==1.15.0"
PEER_PROGRAM = PROGRAMS / "scene_synthesizer_placement.py"
TRACK = find_track("moderate")
CONFIG = GeneratorConfig()
WANTED_RATIO = 5.0
WARM_UP = 3


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Cast:
    """The eight objects of one scene, with their hulls, by name in the scene."""

    number: int
    assets: dict[str, Asset]
    hulls: dict[str, np.ndarray]


def draw_casts(library: AssetLibrary, count: int) -> list[Cast]:
    """Objects for each scene: a light small target and obstacles of both sizes, none twice in a scene."""
    index = library.index().sort_values("name")
    small, large = (list(index[index["size_class"] == size]["name"]) for size in ("small", "large"))
    light = list(index[(index["size_class"] == "small") & (index["mass_kg"] <= CONFIG.max_target_mass_kg)]["name"])
    loaded = {name: library.load(name) for name in (*small, *large)}
    hulls = {name: hull_points(asset) for name, asset in loaded.items()}
    casts: list[Cast] = []
    for number in range(count):
        rng = generator(0, "placement_rate", number)
        target = str(rng.choice(light))
        others = [name for name in small if name != target]
        drawn = [*rng.choice(large, TRACK.large_obstacles, replace=False)]
        drawn += [*rng.choice(others, TRACK.small_obstacles, replace=False)]
        names = {"target": target} | dict(zip(TRACK.obstacle_names, map(str, drawn), strict=True))
        assets = {role: loaded[name] for role, name in names.items()}
        casts.append(Cast(number=number, assets=assets, hulls={role: hulls[name] for role, name in names.items()}))
    return casts


def place_obstacles(objects: Cast, rng: np.random.Generator) -> Layout | None:
    """One draw of a graph and of a placement in which it holds."""
    search = PlacementSearch(
        graph=draw_scene_graph(TRACK, rng),
        assets=objects.assets,
        hulls=objects.hulls,
        track=TRACK,
        rules=CONFIG.rules,
        config=CONFIG.placement,
        rng=rng,
    )
    found = search.run()
    return None if found is None else found[1]


def draw_target(objects: Cast, layout: Layout, rng: np.random.Generator, *, is_goal: bool) -> TargetPoses:
    """Free poses of the target, to start from or to reach."""
    return find_target_poses(
        asset=objects.assets["target"],
        hull=objects.hulls["target"],
        track=TRACK,
        layout=layout,
        relations=(),
        rules=CONFIG.rules,
        config=CONFIG.placement,
        count=CONFIG.pose_draws,
        by_probability=is_goal,
        rng=rng,
    )


def place_once(objects: Cast, rng: np.random.Generator, *, with_pairs: bool) -> bool:
    """Whether one draw placed all eight objects, and found 16 pairs of poses for the target if these are wanted."""
    layout = place_obstacles(objects, rng)
    if layout is None:
        return False
    initial = draw_target(objects, layout, rng, is_goal=False)
    if not with_pairs:
        return len(initial.poses) > 0
    goal = draw_target(objects, layout, rng, is_goal=True)
    return len(pair_up(initial, goal, TRACK.min_displacement_m, TRACK.goal_pairs)) == TRACK.goal_pairs


def time_ours(casts: Sequence[Cast], round_number: int, *, with_pairs: bool) -> tuple[float, int]:
    """Seconds a scene, failed draws included, and their number."""
    draws = 0
    start = time.process_time()
    for objects in casts:
        is_complete = False
        while not is_complete:
            rng = generator(0, "placement_rate", objects.number, round_number, draws)
            is_complete = place_once(objects, rng, with_pairs=with_pairs)
            draws += 1
    return (time.process_time() - start) / len(casts), draws - len(casts)


def write_meshes(casts: Sequence[Cast], folder: Path) -> dict[str, dict[str, Path]]:
    """Each object in its likeliest resting orientation, standing on the origin: as shown, and as its convex hull."""
    files: dict[str, dict[str, Path]] = {"meshes": {}, "hulls": {}}
    for asset in {asset.name: asset for objects in casts for asset in objects.assets.values()}.values():
        parts = [trimesh.Trimesh(item.mesh.vertices, item.mesh.faces, process=False) for item in asset.visual]
        shown = cast(trimesh.Trimesh, trimesh.util.concatenate(parts))
        shown.vertices = rotate(asset.stable.quats_wxyz[0], shown.vertices)
        low, high = shown.bounds
        shown.apply_translation([*(-(low + high) / 2)[:2], -low[2]])
        for kind, mesh in (("meshes", shown), ("hulls", shown.convex_hull)):
            files[kind][asset.name] = folder / f"{asset.name}-{kind}.stl"
            mesh.export(files[kind][asset.name])
    return files


def time_peer(python: Path, casts: Sequence[Cast], files: dict[str, Path]) -> dict[str, list[float]]:
    """The peer's own report."""
    rank = {name: number for number, name in enumerate(files)}
    job = {
        "meshes": [str(path) for path in files.values()],
        "scenes": [[rank[asset.name] for asset in objects.assets.values()] for objects in casts],
        "table_m": TABLE_SIZE_M,
    }
    done = subprocess.run([python, PEER_PROGRAM], input=json.dumps(job), capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(f"the peer failed: {done.stderr.strip().splitlines()[-1]}")
    return json.loads(done.stdout.splitlines()[-1])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if ours is less than five times as fast as the peer at its fastest."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--library", default="procedural")
    parser.add_argument("--peer-python", type=Path, help="interpreter that has the peer; none is made then")
    options = parser.parse_args(arguments)
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    casts = draw_casts(open_library(options.library), options.scenes)
    python = options.peer_python or peer_python([PEER])
    time_ours(casts[:WARM_UP], -1, with_pairs=True)
    ours: dict[bool, list[tuple[float, int]]] = {False: [], True: []}
    peer: dict[str, list[dict[str, list[float]]]] = {"meshes": [], "hulls": []}
    with tempfile.TemporaryDirectory() as folder:
        files = write_meshes(casts, Path(folder))
        for number in range(options.rounds):
            for with_pairs, timed in ours.items():
                timed.append(time_ours(casts, number, with_pairs=with_pairs))
            for kind, reports in peer.items() if python else ():
                reports.append(time_peer(python, casts, files[kind]))
    print(f"{len(casts)} scenes of 8 objects, median of {options.rounds} rounds, one core of: {processor_name()}")
    placing_s = report_ours(ours, len(casts))
    return 0 if python is None or report_peer(peer, placing_s) >= WANTED_RATIO else 1


def report_ours(ours: dict[bool, list[tuple[float, int]]], scenes: int) -> float:
    """Print our rows; returns the seconds of a scene without goal pairs."""
    print(f"{'processor time':<72}{'s/scene':>9}{'scenes/s':>10}")
    labels = {False: "ours: graph, 8 objects", True: "ours: graph, 8 objects, 16 start and goal poses"}
    medians: dict[bool, float] = {}
    for with_pairs, timed in ours.items():
        medians[with_pairs] = float(np.median([seconds for seconds, _ in timed]))
        failed = sum(failures for _, failures in timed) / len(timed) / scenes
        label = f"{labels[with_pairs]} ({failed:.2f} failed draws)"
        print(f"{label:<72}{medians[with_pairs]:>9.4f}{1 / medians[with_pairs]:>10.1f}")
    return medians[False]


def report_peer(peer: dict[str, list[dict[str, list[float]]]], ours_s: float) -> float:
    """Print the peer's rows; returns how many times as fast ours is with the same meshes."""
    for kind, reports in peer.items():
        seconds = float(np.median([np.mean(item["placing_s"]) for item in reports]))
        label = f"scene_synthesizer {reports[0]['version']}: 8 objects, colliding {kind}"
        print(f"{label:<72}{seconds:>9.4f}{1 / seconds:>10.1f}   ours is {seconds / ours_s:.1f} times as fast")
    together = [item for reports in peer.values() for item in reports]
    preparing = np.median([seconds for item in together for seconds in item["preparing_s"]])
    lacking = sum(not done for item in together for done in item["complete"])
    print(
        f"not counted: the peer's empty table, {preparing:.4f} s a scene; peer's scenes that lack an object: {lacking}"
    )
    return float(np.median([np.mean(item["placing_s"]) for item in peer["meshes"]])) / ours_s


if __name__ == "__main__":
    sys.exit(main())
