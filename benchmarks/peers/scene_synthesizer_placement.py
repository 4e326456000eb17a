"""Objects placed on a table by scene_synthesizer; run by an interpreter that has it (see ``placement_rate.py``).

Reads a job from standard input (``meshes``: files; ``scenes``: for each, indices of its objects; ``table_m``). Writes
to standard output, for each scene, the processor time of placing alone and of preparing the empty table before.
"""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
import scene_synthesizer
import trimesh
from scene_synthesizer import utils
from scene_synthesizer.procedural_assets import TableAsset

TABLE_HEIGHT_M = 0.7
WARM_UP = 3


def place(assets: list, table: TableAsset, objects: list[int], seed: int) -> tuple[float, float, bool]:
    """Seconds for placing, seconds for the table and its support, and whether all objects found a place."""
    rng = np.random.Generator(np.random.PCG64(seed))
    start = time.process_time()
    scene = scene_synthesizer.Scene(seed=rng)
    scene.add_object(table, "table")
    support = max(scene.label_support("table_top", obj_ids="table"), key=lambda found: found.polygon.area)
    ready = time.process_time()
    is_complete = scene.place_objects(
        obj_id_iterator=utils.object_id_generator("object"),
        obj_asset_iterator=[assets[index] for index in objects],
        obj_support_id_iterator=iter(lambda: support, None),
        obj_position_iterator=utils.PositionIteratorUniform(seed=rng),
        obj_orientation_iterator=utils.orientation_generator_uniform_around_z(seed=rng),
    )
    return time.process_time() - ready, ready - start, is_complete


def main() -> None:
    """Do the job."""
    job = json.load(sys.stdin)
    assets = [scene_synthesizer.TrimeshAsset(trimesh.load(path, force="mesh")) for path in job["meshes"]]
    table = TableAsset(*job["table_m"], TABLE_HEIGHT_M)
    for seed, objects in enumerate(job["scenes"][:WARM_UP]):
        place(assets, table, objects, seed)
    timed = [place(assets, table, objects, 1000 + seed) for seed, objects in enumerate(job["scenes"])]
    placing, preparing, complete = zip(*timed, strict=True)
    report = {"placing_s": placing, "preparing_s": preparing, "complete": complete}
    json.dump({"version": version("scene-synthesizer"), **report}, sys.stdout)


if __name__ == "__main__":
    main()
