"""Control steps a second of the environment on a GPU, with observation, reward and resets.

python benchmarks/gpu_speed.py [--device cuda] [--envs 256,1024,4096] [--steps 100] [--split sparse-train] [--record]
"""

import argparse
import sys
from collections.abc import Callable, Sequence

from bars import bar
from machine import seconds_of
from tables import Report, add_record_option

from clutter6d.envs.warp_env import WarpVectorEnv
from clutter6d.physics import CONTROL_STEP_S
from clutter6d.sim.warp_runtime import torch


def measure(env: WarpVectorEnv, steps: int) -> tuple[float, float]:
    """Control steps a second of all environments together: simulation alone, and the environment."""
    env.reset(seed=0)
    shape, scale = (env.num_envs, 7), env.action_scale_rad
    draws = torch.Generator(env.device).manual_seed(0)

    def act() -> None:
        env.step(scale * (2 * torch.rand(shape, generator=draws, device=env.device) - 1))

    def run(step: Callable[[], object], label: str) -> float:
        def all_steps() -> None:
            for _ in bar(range(steps), label):
                step()
            env.slots.batch.is_unstable().any().item()

        return env.num_envs * steps / seconds_of(all_steps)

    act()
    return run(env.slots.batch.step, "simulation"), run(act, "environment")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a row for each number of environments."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--envs", default="256,1024,4096")
    parser.add_argument("--steps", type=int, default=100)
    parser.add_argument("--split", default="sparse-train")
    add_record_option(parser)
    options = parser.parse_args(arguments)
    report = Report("gpu_speed")
    is_cuda = options.device.startswith("cuda")
    name = (
        torch.cuda.get_device_name(options.device) if is_cuda else "Warp's CPU device: for tests, no measure of speed"
    )
    report.say(f"Control steps of {CONTROL_STEP_S} s a second, {options.split}, device: {name}.")
    report.head("environments", "simulation", "environment")
    for count in map(int, options.envs.split(",")):
        env = WarpVectorEnv(count, device=options.device, split=options.split)
        simulation, whole = measure(env, options.steps)
        report.row(str(count), f"{simulation:,.0f}", f"{whole:,.0f}")
    report.keep(options.record)
    return 0


if __name__ == "__main__":
    sys.exit(main())
