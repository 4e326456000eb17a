"""Genesis on the CPU: its own Panda and boxes on a plane, many environments in one batch on all cores."""

import turns  # isort: skip

import os

os.environ["PYTHONWARNINGS"] = "ignore"

import genesis
import numpy as np
import torch

CONTROL_S = 0.1
HOME = (0.0, -0.6648, 0.0, -2.3850, 0.0, 1.7202, 0.7854, 0.0, 0.0)
BOX_M = (0.06, 0.08, 0.10)
ACTION_SCALE_RAD = 0.1


def main() -> None:
    """Step with random joint residuals; the boxes' and the arm's states are read after every control step."""
    physics_step_s, environments, objects = (turns.JOB[key] for key in ("physics_step_s", "environments", "objects"))
    torch.set_num_threads(len(os.sched_getaffinity(0)))
    genesis.init(backend=genesis.cpu, logging_level="error", seed=turns.JOB["seed"], performance_mode=True)
    scene = genesis.Scene(sim_options=genesis.options.SimOptions(dt=physics_step_s), show_viewer=False)
    scene.add_entity(genesis.morphs.Plane())
    arm = scene.add_entity(genesis.morphs.MJCF(file="xml/franka_emika_panda/panda.xml"))
    places = [(0.45 + 0.16 * (i % 3), -0.38 + 0.25 * (i // 3), BOX_M[2] / 2) for i in range(objects)]
    boxes = [scene.add_entity(genesis.morphs.Box(size=BOX_M, pos=place)) for place in places]
    scene.build(n_envs=environments)
    arm.set_qpos(torch.tensor(HOME).repeat(environments, 1))
    rng = np.random.Generator(np.random.PCG64(turns.JOB["seed"]))
    scale = ACTION_SCALE_RAD * np.array([1.0] * 7 + [0.0] * 2)

    def step() -> None:
        residuals = rng.uniform(-scale, scale, size=(environments, len(HOME))).astype(np.float32)
        arm.control_dofs_position(arm.get_qpos() + torch.from_numpy(residuals))
        for _ in range(round(CONTROL_S / physics_step_s)):
            scene.step()
        for box in boxes:
            _ = (box.get_pos(), box.get_quat(), box.get_vel())
        _ = arm.get_qvel() if hasattr(arm, "get_qvel") else arm.get_dofs_velocity()

    about = {"version": f"Genesis {genesis.__version__}", "objects": objects, "physics_step_s": physics_step_s}
    turns.serve(step, environments * CONTROL_S, about)


if __name__ == "__main__":
    main()
