"""robosuite's PickPlace: a Panda, four objects, two bins. One process is one environment."""

import turns  # isort: skip

from importlib.metadata import version

import numpy as np
import robosuite

CONTROL_HZ = 10
NEVER = 10**9


def main() -> None:
    """Step with random actions; low-dimensional observations, nothing rendered, no episode ends."""
    environment = robosuite.make(
        "PickPlace",
        robots="Panda",
        has_renderer=False,
        has_offscreen_renderer=False,
        use_camera_obs=False,
        use_object_obs=True,
        reward_shaping=True,
        control_freq=CONTROL_HZ,
        horizon=NEVER,
        ignore_done=True,
    )
    environment.reset()
    low, high = environment.action_spec
    rng = np.random.Generator(np.random.PCG64(turns.JOB["seed"]))
    about = {
        "version": f"robosuite {version('robosuite')}, MuJoCo {version('mujoco')}",
        "objects": 4,
        "physics_step_s": float(environment.model_timestep),
    }
    turns.serve(lambda: environment.step(rng.uniform(low, high)), 1 / CONTROL_HZ, about)


if __name__ == "__main__":
    main()
