"""How much of the bare engine's speed is left when stepping through the vector environment.

``ClutterVectorEnv.step`` with the full point-cloud observation, reward, terminations and ``info``, against
``mujoco.batch`` alone on the same models, from the same states, with the same joint targets, on as many threads, in
turns. Every environment has a frozen scene and a goal pair of its own; actions are random.

    python benchmarks/step_speed.py [--envs 64] [--steps 20] [--rounds 7] [--tracks sparse,moderate,dense] [--record]
"""

import argparse
import sys
from collections.abc import Sequence

from bars import bar
from environment_runs import BareRun, EnvironmentRun, check_same_end, fastest
from frozen_tasks import SPLITS
from generated_scenes import FirstScenes
from machine import cores, seconds_of
from tables import Report, add_record_option

from clutter6d.dataset.scenes import load_split
from clutter6d.physics import CONTROL_STEP_S

WANTED_RATIO = 0.8


def measure(split: str, envs: int, steps: int, rounds: int, threads: int) -> tuple[float, float]:
    """Control steps per second of all environments together: bare engine, environment; each its fastest round."""
    full = EnvironmentRun(FirstScenes(load_split(split), envs), envs, steps, threads)
    full.record()
    bare = BareRun(full, threads)
    times: list[tuple[float, float]] = []
    for _ in bar(range(rounds), split):
        full.reset()
        bare.reset()
        times.append((seconds_of(bare.run), seconds_of(full.run)))
        check_same_end(full, bare)
    bare_s, full_s = map(fastest, zip(*times, strict=True))
    return envs * steps / bare_s, envs * steps / full_s


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; exit code 1 if the sparse ratio is below the wanted one."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--envs", type=int, default=64)
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--tracks", default=",".join(SPLITS))
    add_record_option(parser)
    options = parser.parse_args(arguments)
    threads = options.threads or cores()
    report = Report("step_speed")
    report.say(
        f"{options.envs} environments on {threads} threads, each with a frozen scene of its own; control steps of "
        f"{CONTROL_STEP_S} s per second, fastest of {options.rounds} rounds in turns of {options.steps} steps."
    )
    report.head("track", "`mujoco.batch` alone", "environment", "ratio", "simulated s per s and core")
    ratios: dict[str, float] = {}
    for track in options.tracks.split(","):
        bare, full = measure(SPLITS[track], options.envs, options.steps, options.rounds, threads)
        ratios[track] = full / bare
        per_core = full * CONTROL_STEP_S / threads
        report.row(track, f"{bare:,.0f}", f"{full:,.0f}", f"{ratios[track]:.2f}", f"{per_core:,.0f}")
    report.keep(options.record)
    return 0 if ratios.get("sparse", 1.0) >= WANTED_RATIO else 1


if __name__ == "__main__":
    sys.exit(main())
