"""panda-gym's PandaStack with joint control: a Panda and two cubes, in PyBullet. One process is one environment."""

import turns  # isort: skip

from importlib.metadata import version

import gymnasium
import numpy as np
import panda_gym  # noqa: F401 - registers the environments

CONTROL_S = 0.1


def main() -> None:
    """Step with random actions; low-dimensional observations, nothing rendered, no episode ends."""
    environment = gymnasium.make("PandaStackJoints-v3").unwrapped
    environment.sim.n_substeps = round(CONTROL_S / environment.sim.timestep)
    environment.reset(seed=turns.JOB["seed"])
    space = environment.action_space
    space.seed(turns.JOB["seed"])
    about = {
        "version": f"panda-gym {version('panda-gym')}, PyBullet {version('pybullet')}",
        "objects": 2,
        "physics_step_s": environment.sim.timestep,
    }

    def step() -> None:
        environment.step(space.sample().astype(np.float32))

    turns.serve(step, CONTROL_S, about)


if __name__ == "__main__":
    main()
