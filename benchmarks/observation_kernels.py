"""How long the point clouds of an observation take in NumPy, torch and numba, on one thread and on all.

All of them give the same features: numba and NumPy to the bit, torch to a rounding error. ``readable`` is the code of
``clutter6d.envs.point_cloud``, which runs on NumPy's arrays as on torch's; ``in place`` is NumPy made for speed. torch
is left out where it is not installed.

    python benchmarks/observation_kernels.py [--slots 64] [--objects 4,8,12] [--rounds 30] [--record]
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from bars import bar
from machine import cores, seconds_of
from numpy_clouds import numpy_point_clouds
from tables import Report, add_record_option

from clutter6d.envs.point_cloud import (
    PointClouds,
    RigidMotion,
    SceneClouds,
    free_body_motion,
    motion_in_world,
    point_clouds,
)
from clutter6d.envs.point_kernel import compiled_point_clouds
from clutter6d.geometry import quat_normalize
from clutter6d.seeding import generator

Inputs = tuple[SceneClouds, RigidMotion, RigidMotion]
Parts = list[slice]


def make_inputs(slots: int, objects: int) -> Inputs:
    """Clouds of the size of real objects, at random poses over a table."""
    rng = generator(0, "observation_kernels", objects)
    clouds = SceneClouds.allocate(slots, objects)
    clouds.points[:] = rng.normal(scale=0.04, size=clouds.points.shape)
    clouds.point_mass[:] = rng.uniform(1e-4, 1e-3, size=clouds.point_mass.shape)
    clouds.target_centroid[:] = clouds.points[:, 0].mean(axis=-1, keepdims=True)
    poses = rng.uniform(-0.3, 0.3, size=(slots, objects, 7))
    poses[..., 3:] = quat_normalize(rng.normal(size=(slots, objects, 4)))
    velocities = rng.normal(scale=0.1, size=(slots, objects, 6))
    hands = motion_in_world(poses[:, 0], velocities[:, 0, :3], velocities[:, 0, 3:])
    return clouds, free_body_motion(poses, velocities), hands


def rows_of(inputs: Inputs, part: slice) -> Inputs:
    """The inputs of some slots."""
    clouds, objects, hands = inputs
    return clouds[part], objects[part, :], hands[part, :]


def split_rows(slots: int, parts: int) -> Parts:
    """Nearly equal parts."""
    edges = np.linspace(0, slots, parts + 1).astype(int).tolist()
    return [slice(first, last) for first, last in pairwise(edges)]


def numpy_calls(inputs: Inputs, threads: int, pool: ThreadPoolExecutor) -> dict[str, Callable[[], object]]:
    """The contestants on NumPy's arrays; where threads share the work, each has a part of the slots."""
    parts = split_rows(len(inputs[0].points), threads)
    pieces = [rows_of(inputs, part) for part in parts]

    def by_parts(make: Callable[..., PointClouds]) -> list[PointClouds]:
        return list(pool.map(lambda piece: make(*piece), pieces))

    def each_part(_: int, fill: Callable[[slice], None]) -> None:
        list(pool.map(fill, parts))

    if threads == 1:
        calls = (partial(make, *inputs) for make in (point_clouds, numpy_point_clouds, compiled_point_clouds))
    else:
        in_parts = (partial(by_parts, make) for make in (point_clouds, numpy_point_clouds))
        calls = (*in_parts, partial(compiled_point_clouds, *inputs, each_part=each_part))
    return dict(zip(("NumPy, readable", "NumPy, in place", "numba"), calls, strict=True))


@contextmanager
def torch_calls(inputs: Inputs, threads: int) -> Iterator[dict[str, Callable[[], object]]]:
    """The readable code on torch's tensors; nothing without torch."""
    try:
        import torch
    except ImportError:
        yield {}
        return

    def as_tensors(value: Any) -> Any:
        if is_dataclass(value):
            return type(value)(**{field.name: as_tensors(getattr(value, field.name)) for field in fields(value)})
        return torch.as_tensor(value)

    before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        yield {"torch, readable": partial(point_clouds, *(as_tensors(each) for each in inputs))}
    finally:
        torch.set_num_threads(before)


def milliseconds(slots: int, objects: int, threads: int, rounds: int) -> dict[str, float]:
    """The fastest call of each contestant; they run in turns."""
    inputs = make_inputs(slots, objects)
    with ThreadPoolExecutor(threads) as pool, torch_calls(inputs, threads) as on_tensors:
        calls = numpy_calls(inputs, threads, pool) | on_tensors
        for call in calls.values():
            call()
        turns = [
            {name: seconds_of(call) for name, call in calls.items()}
            for _ in bar(range(rounds), f"{objects} objects, threads: {threads}")
        ]
    return {name: 1e3 * min(turn[name] for turn in turns) for name in calls}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--slots", type=int, default=64)
    parser.add_argument("--objects", default="4,8,12")
    parser.add_argument("--rounds", type=int, default=30)
    add_record_option(parser)
    options = parser.parse_args(arguments)
    sizes = [int(objects) for objects in options.objects.split(",")]
    report = Report("observation_kernels")
    report.say(
        f"Point clouds of {options.slots} slots: milliseconds of a call, fastest of {options.rounds} in turns; in "
        "brackets how many times as long as numba."
    )
    for threads in sorted({1, cores()}):
        columns = [milliseconds(options.slots, objects, threads, options.rounds) for objects in sizes]
        report.head(f"threads: {threads}", *(f"{objects} objects" for objects in sizes))
        for name in columns[0]:
            report.row(name, *(f"{column[name]:.2f} ({column[name] / column['numba']:.1f})" for column in columns))
    report.keep(options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
