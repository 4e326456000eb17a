"""Where the time of a physics step goes: each stage of the engine, called by itself on states along scripted pushes."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from frozen_tasks import Tasks

from clutter6d.sim.batch import SceneBatch

Stage = Callable[[mujoco.MjModel, mujoco.MjData], None]
STAGES: dict[str, tuple[Stage, ...]] = {
    "kinematics and inertia": (
        mujoco.mj_kinematics,
        mujoco.mj_comPos,
        mujoco.mj_makeM,
        mujoco.mj_factorM,
        mujoco.mj_transmission,
    ),
    "collision": (mujoco.mj_collision,),
    "constraints: rows, islands, projection": (
        mujoco.mj_makeConstraint,
        mujoco.mj_island,
        mujoco.mj_projectConstraint,
    ),
    "velocities, actuation, free acceleration": (
        mujoco.mj_fwdVelocity,
        mujoco.mj_fwdActuation,
        mujoco.mj_fwdAcceleration,
    ),
    "constraint solver": (mujoco.mj_fwdConstraint,),
}
LOOK_EVERY, REPEATS = 3, 5
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


@dataclass(frozen=True, kw_only=True, slots=True)
class Stages:
    """Means over states.

    Attributes:
        stage_us: Processor time of each stage [microseconds].
        step_us: Processor time of a whole step.
        contacts: Contact points.
        rows: Rows of the constraint problem.
    """

    stage_us: dict[str, float]
    step_us: float
    contacts: float
    rows: float


def time_stages(tasks: Tasks, targets: np.ndarray) -> Stages:
    """Play pushes, and time the stages at every third control step."""
    batch = SceneBatch(tasks.models, threads=1)
    batch.reset(np.arange(len(tasks)), tasks.object_poses)
    data = [mujoco.MjData(scene.model) for scene in tasks.models]
    times: dict[str, list[float]] = {name: [] for name in STAGES}
    whole: list[float] = []
    sizes: list[tuple[int, int]] = []
    for number, row in enumerate(targets):
        batch.joint_targets[:] = row
        batch.step()
        for scene, single, state in zip(tasks.models, data, batch.states, strict=True):
            if number % LOOK_EVERY:
                continue
            model = scene.model
            mujoco.mj_setState(model, single, state, STATE)
            whole.append(_seconds(lambda m, d: mujoco.mj_step(m, d, nstep=REPEATS), model, single, 1) / REPEATS)
            for name, stages in STAGES.items():
                times[name].append(sum(_seconds(stage, model, single, REPEATS) for stage in stages))
            sizes.append((single.ncon, single.nefc))
    contacts, rows = np.mean(sizes, axis=0)
    return Stages(
        stage_us={name: 1e6 * float(np.mean(found)) for name, found in times.items()},
        step_us=1e6 * float(np.mean(whole)),
        contacts=float(contacts),
        rows=float(rows),
    )


def _seconds(stage: Stage, model: mujoco.MjModel, data: mujoco.MjData, repeats: int) -> float:
    start = time.thread_time()
    for _ in range(repeats):
        stage(model, data)
    return (time.thread_time() - start) / repeats
