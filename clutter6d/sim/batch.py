"""Many different scenes side by side: the one place where simulation is stepped."""

import logging
from collections.abc import Sequence

import mujoco
import numpy as np
from jaxtyping import Float64, Int
from mujoco.batch import Batch

from clutter6d.errors import InvalidValueError
from clutter6d.physics import PHYSICS_STEPS_PER_CONTROL_STEP
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import ARM_DOF, SceneModel

Slots = Int[np.ndarray, "slot"]

# Left alone, the engine prints its warnings and writes MUJOCO_LOG.TXT into the working directory.
mujoco.set_mju_user_warning(logging.getLogger("mujoco").debug)


class SceneBatch:
    """N slots, each running a scene of its own; results are the same to the bit on any number of threads.

    Arrays of this class are live views with one row a slot. World frame; a free body's angular velocity is in its own
    frame, as MuJoCo has it.

    Args:
        scenes: The scene of each slot; all with as many objects. If its objects may sleep
            (:func:`clutter6d.sim.model_variation.let_sleep`), who sleeps is remembered from step to step, outside the
            states.
        threads: Threads that step slots at once; 0 for all cores.

    Raises:
        InvalidValueError: No scene, or scenes with different numbers of objects.
    """

    def __init__(self, scenes: Sequence[SceneModel], *, threads: int = 0) -> None:
        if not scenes or len({scene.object_count for scene in scenes}) != 1:
            raise InvalidValueError("a batch needs at least one scene, and all scenes with the same number of objects")
        self.scenes = list(scenes)
        self._can_sleep = bool(scenes[0].model.opt.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP)
        self._batch = Batch(scenes[0].model, len(scenes), threads, self._can_sleep)
        self._batch.set_models([scene.model for scene in scenes])
        objects = scenes[0].object_count
        qpos, qvel = self._batch.bind("qpos"), self._batch.bind("qvel")
        self.arm_qpos = qpos[:, :ARM_DOF]
        self.arm_qvel = qvel[:, :ARM_DOF]
        self.object_poses = qpos[:, ARM_DOF:].reshape(len(scenes), objects, 7)
        self.object_velocities = qvel[:, ARM_DOF:].reshape(len(scenes), objects, 6)
        self.joint_targets = self._batch.bind("ctrl")
        if not np.shares_memory(self.object_poses, qpos):
            raise InvalidValueError("the batch's state rows cannot be viewed per object")
        self.reset(np.arange(len(scenes)), np.tile([0.0, 0, -1, 1, 0, 0, 0], (len(scenes), objects, 1)))

    @property
    def size(self) -> int:
        """Number of slots."""
        return len(self.scenes)

    @property
    def states(self) -> Float64[np.ndarray, "slot state"]:
        """The full integration state of every slot, a live view; where objects may sleep, write with :meth:`put`."""
        return self._batch.state

    def load(self, slots: Slots, scenes: Sequence[SceneModel]) -> None:
        """Give slots other scenes; reset them before stepping."""
        for slot, scene in zip(slots, scenes, strict=True):
            self.scenes[slot] = scene
        self._batch.set_models([scene.model for scene in self.scenes])

    def reset(
        self,
        slots: Slots,
        object_poses: Float64[np.ndarray, "slot object 7"],
        arm_qpos: Float64[np.ndarray, "7"] = HOME_QPOS,
    ) -> None:
        """Set slots to given poses at rest, with the arm at rest and its targets where it is."""
        self.put(slots, 0.0)
        self._batch.warning[slots] = 0
        self.arm_qpos[slots] = arm_qpos
        self.joint_targets[slots] = arm_qpos
        self.object_poses[slots] = object_poses

    def put(self, slots: Slots, states: Float64[np.ndarray, "slot state"] | float) -> None:
        """Set the full states of slots; who slept is awake."""
        if self._can_sleep:
            self._batch.reset(slots, stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        self.states[slots] = states

    def step(self, slots: Slots | None = None, *, physics_steps: int = PHYSICS_STEPS_PER_CONTROL_STEP) -> None:
        """Advance slots (default: all); one control step of 0.1 s by default.

        Raises:
            mujoco.batch.SimulationError: The engine raised an error; the slots concerned keep their state.
        """
        self._batch.step(slots, nstep=physics_steps)

    def step_delayed(
        self,
        slots: Slots,
        old_targets: Float64[np.ndarray, "slot 7"],
        delays: Int[np.ndarray, "slot"],
        *,
        physics_steps: int = PHYSICS_STEPS_PER_CONTROL_STEP,
    ) -> None:
        """Advance slots whose arms hear of their joint targets late; without a delay equal to :meth:`step` to the bit.

        Args:
            slots: Which.
            old_targets: What the arm follows until then [rad]; afterwards it follows ``joint_targets``.
            delays: Physics steps of 5 ms for which it does; from ``physics_steps`` on, throughout.
            physics_steps: Physics steps to advance.

        Raises:
            mujoco.batch.SimulationError: The engine raised an error; the slots concerned keep their state.
        """
        targets = self.joint_targets[slots]
        is_late = np.arange(physics_steps) < delays[:, None]
        controls = np.where(is_late[..., None], old_targets[:, None], targets[:, None])
        try:
            self._batch.rollout(physics_steps, controls, record=(), ids=slots)
        finally:
            self.joint_targets[slots] = targets

    def unstable_slots(self) -> Slots:
        """Slots whose state is not finite or in which the engine warned of a bad state since the last reset."""
        bad = [mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC]
        warned = self._batch.warning[:, [int(kind) for kind in bad], 1] > 0
        return np.flatnonzero(warned.any(axis=1) | ~np.isfinite(self.states).all(axis=1))
