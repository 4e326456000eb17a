"""How much of the bare simulation's speed is left when stepping through the environment, with observation and reward.

Both run the same models from the same states with the same joint targets, on the same threads, in turn. Prints one
row for each track:

    python benchmarks/step_speed.py [--envs 64] [--steps 20] [--rounds 5] [--threads 0]
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from clutter6d.assets.asset import Asset
from clutter6d.envs.slots import ClutterSlots
from clutter6d.geometry import Pose
from clutter6d.scene import GoalPair
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel, compile_scene

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tests.scene_fixtures import OBSTACLE_SIZES_M, TARGET_SIZE_M, make_box_asset

OBJECTS = {"sparse": 4, "moderate": 8, "dense": 12}
WANTED_RATIO = 0.7


def make_task(objects: int, index: int) -> tuple[SceneModel, GoalPair]:
    """Boxes on a grid, of sizes that differ from scene to scene; everything at rest."""
    rng = generator(0, "step_speed", index)
    sizes = [TARGET_SIZE_M, *(OBSTACLE_SIZES_M[i % 3] for i in range(objects - 1))]
    assets: list[Asset] = [
        make_box_asset(f"box-{index}-{i}", tuple(np.round(np.array(size) * rng.uniform(0.9, 1.1), 4)))
        for i, size in enumerate(sizes)
    ]
    cells = [(-0.12 + 0.16 * (i % 3), -0.38 + 0.25 * (i // 3)) for i in range(objects)]
    poses = np.array([[x, y, asset.extents_m[2] / 2, 1, 0, 0, 0] for (x, y), asset in zip(cells, assets, strict=True)])
    start = Pose.from_row(poses[0])
    goal = Pose(position=(0.1, 0.2, start.position[2]), quat_wxyz=start.quat_wxyz)
    pair = GoalPair(
        initial=start,
        goal=goal,
        object_poses=poses,
        initial_stable_index=0,
        goal_stable_index=0,
        is_path_blocked=False,
        changes_resting_face=False,
    )
    return compile_scene([(f"object_{i}", asset) for i, asset in enumerate(assets)]), pair


def seconds_of(run: Callable[[], None]) -> float:
    """Wall time of a call."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def measure(objects: int, envs: int, steps: int, rounds: int, threads: int) -> tuple[float, float]:
    """Control steps per second of all slots together: bare simulation, environment; each its fastest round."""
    tasks = [make_task(objects, index) for index in range(envs)]
    models, pairs = [task[0] for task in tasks], [task[1] for task in tasks]
    slots = np.arange(envs)
    env = ClutterSlots(models, threads=threads)
    env.load(slots, models, pairs)
    actions = generator(0, "actions").uniform(-0.05, 0.05, size=(steps, envs, 7)).astype(np.float32)
    targets = np.empty((steps, envs, 7))

    def through_environment() -> None:
        for index in range(steps):
            env.step(slots, actions[index])
            env.observe()
            env.reward()
            targets[index] = env.batch.joint_targets

    def bare() -> None:
        for index in range(steps):
            env.batch.joint_targets[:] = targets[index]
            env.batch.step()

    times: list[tuple[float, float]] = []
    for _ in range(rounds):
        env.reset(slots)
        with_environment = seconds_of(through_environment)
        end = env.batch.states.copy()
        env.reset(slots)
        times.append((seconds_of(bare), with_environment))
        if not np.array_equal(end, env.batch.states):
            raise SystemExit("the bare simulation did not follow the environment")
    return tuple(envs * steps / min(column) for column in zip(*times, strict=True))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if the sparse ratio is below the wanted one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args(arguments)
    print(f"{options.envs} environments, control steps per second (0.1 s each), fastest of {options.rounds} rounds")
    print(f"{'track':<10}{'mujoco.batch':>14}{'environment':>14}{'ratio':>8}")
    ratios: dict[str, float] = {}
    for track, objects in OBJECTS.items():
        bare, full = measure(objects, options.envs, options.steps, options.rounds, options.threads)
        ratios[track] = full / bare
        print(f"{track:<10}{bare:>14,.0f}{full:>14,.0f}{ratios[track]:>8.2f}", flush=True)
    return 0 if ratios["sparse"] >= WANTED_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())
