"""Many different scenes side by side on a GPU: MuJoCo Warp in place of :mod:`clutter6d.sim.batch`.

The same models with the same options, in float32. It is not deterministic, so policies are trained with it and never
scored; ``docs/gpu.md`` says what was found out and measured.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from clutter6d.errors import InvalidValueError
from clutter6d.physics import PHYSICS_STEPS_PER_CONTROL_STEP
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import ARM_DOF, SceneModel
from clutter6d.sim.warp_buffers import BufferSizes, OverflowWatch, allocate_data, default_sizes
from clutter6d.sim.warp_layout import WORLD_FIELDS, WorldLayout
from clutter6d.sim.warp_meshes import MeshPool
from clutter6d.sim.warp_runtime import mujoco_warp, on_device, open_device, torch, warp

Slots = Int[np.ndarray, "slot"] | Int[torch.Tensor, "slot"]
LARGEST_VALUE = 1e10
"""A state beyond this is invalid; MuJoCo's own bound."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class WarpState:
    """A copy of what decides how the worlds go on."""

    qpos: Float32[torch.Tensor, "slot qpos"]
    qvel: Float32[torch.Tensor, "slot qvel"]
    warm_start: Float32[torch.Tensor, "slot qvel"]


class WarpSceneBatch:
    """N slots, each running a scene of its own, on one device.

    Arrays of this class are live float32 tensors on the device with one row a slot; they share memory with the
    simulation. World frame; a free body's angular velocity is in its own frame, as MuJoCo has it.

    Args:
        scenes: The scene of each slot; all with as many objects.
        device: ``"cuda"``, ``"cuda:1"`` ..., or ``"cpu"`` (for tests: it is slow).
        sizes: Room for contacts and constraints; by default what the track's scenes were measured to need, and more.

    Raises:
        InvalidValueError: No scene, scenes with different numbers of objects, or no such device.
    """

    def __init__(self, scenes: Sequence[SceneModel], *, device: str = "cuda", sizes: BufferSizes | None = None) -> None:
        if not scenes or len({scene.object_count for scene in scenes}) != 1:
            raise InvalidValueError("a batch needs at least one scene, and all scenes with the same number of objects")
        self.device, self.scenes = open_device(device), list(scenes)
        count, self._layout = len(scenes), WorldLayout(scenes[0].object_count)
        self.sizes = sizes or default_sizes(self._layout.object_count)
        self._model, self._data = _allocate(self._layout, count, self.sizes, self.device)
        self._worlds = {name: warp.to_torch(getattr(self._model, name)) for name in WORLD_FIELDS}
        self.meshes, self._graphs = MeshPool(self.device), dict[int, Any]()
        self._graph_revision = -1
        self._qpos, self._qvel = warp.to_torch(self._data.qpos), warp.to_torch(self._data.qvel)
        self._warm_start = warp.to_torch(self._data.qacc_warmstart)
        self.arm_qpos, self.arm_qvel = self._qpos[:, :ARM_DOF], self._qvel[:, :ARM_DOF]
        self.object_poses = self._qpos[:, ARM_DOF:].view(count, self._layout.object_count, 7)
        self.object_velocities = self._qvel[:, ARM_DOF:].view(count, self._layout.object_count, 6)
        self.joint_targets = warp.to_torch(self._data.ctrl)
        self._watch = OverflowWatch(self._data, self.sizes, count)
        self.load(np.arange(count), scenes)
        self.reset(np.arange(count), np.tile([0.0, 0, -1, 1, 0, 0, 0], (count, self._layout.object_count, 1)))

    @property
    def size(self) -> int:
        """Number of slots."""
        return len(self.scenes)

    def load(self, slots: Slots, scenes: Sequence[SceneModel]) -> None:
        """Give slots other scenes; reset them before stepping. Nothing is compiled.

        Raises:
            InvalidValueError: A scene has another number of objects.
        """
        if any(scene.object_count != self._layout.object_count for scene in scenes):
            raise InvalidValueError(f"this batch runs scenes of {self._layout.object_count} objects")
        rows = [self._layout.row(scene, self._mesh_ids(scene)) for scene in scenes]
        where = self._index(slots)
        for name, values in self._worlds.items() if rows else ():
            stacked = torch.from_numpy(np.stack([row[name] for row in rows]))
            values[where] = stacked.to(values).view(len(rows), *values.shape[1:])
        for slot, scene in zip(where.tolist(), scenes, strict=True):
            self.scenes[slot] = scene

    def reset(
        self,
        slots: Slots,
        object_poses: Float[np.ndarray, "slot object 7"] | Float[torch.Tensor, "slot object 7"],
        arm_qpos: Float[np.ndarray, "7"] = HOME_QPOS,
    ) -> None:
        """Set slots to given poses at rest, with the arm at rest and its targets where it is."""
        where = self._index(slots)
        self._qvel[where] = 0
        self._warm_start[where] = 0
        self.arm_qpos[where] = self.joint_targets[where] = torch.as_tensor(arm_qpos).to(self._qpos)
        self.object_poses[where] = torch.as_tensor(object_poses).to(self._qpos)

    def step(self, slots: Slots | None = None, *, physics_steps: int = PHYSICS_STEPS_PER_CONTROL_STEP) -> None:
        """Advance slots (default: all); one control step of 0.1 s by default.

        The device always computes all worlds; what is not to be stepped is put back.
        """
        before = None if slots is None else self.save()
        self._launch(physics_steps)
        if before is not None and slots is not None:
            others = torch.ones(self.size, dtype=torch.bool, device=self.device)
            others[self._index(slots)] = False
            self.restore(before, others)
        self._watch.look()

    def step_delayed(
        self,
        old_targets: Float32[torch.Tensor, "slot 7"],
        delays: Int[torch.Tensor, "slot"],
        *,
        physics_steps: int = PHYSICS_STEPS_PER_CONTROL_STEP,
    ) -> None:
        """Advance all slots, whose arms hear of their joint targets late.

        Args:
            old_targets: What the arm follows until then [rad]; afterwards it follows ``joint_targets``.
            delays: Physics steps of 5 ms for which it does.
            physics_steps: Physics steps to advance.
        """
        targets = self.joint_targets.clone()
        for step in range(physics_steps):
            self.joint_targets.copy_(torch.where((step < delays)[:, None], old_targets, targets))
            self._launch(1)
        self.joint_targets.copy_(targets)
        self._watch.look()

    def save(self) -> WarpState:
        """A copy of the state of all slots."""
        return WarpState(qpos=self._qpos.clone(), qvel=self._qvel.clone(), warm_start=self._warm_start.clone())

    def restore(self, state: WarpState, mask: Bool[torch.Tensor, "slot"]) -> None:
        """Put the slots of a mask back into a state; their joint targets stay."""
        rows = mask[:, None]
        self._qpos.copy_(torch.where(rows, state.qpos, self._qpos))
        self._qvel.copy_(torch.where(rows, state.qvel, self._qvel))
        self._warm_start.copy_(torch.where(rows, state.warm_start, self._warm_start))

    def is_unstable(self) -> Bool[torch.Tensor, "slot"]:
        """Which slots have a state that is not finite or beyond MuJoCo's bound."""
        return ~((self._qpos.abs() < LARGEST_VALUE).all(dim=1) & (self._qvel.abs() < LARGEST_VALUE).all(dim=1))

    def unstable_slots(self) -> Int[torch.Tensor, "unstable"]:
        """The same as indices; waits for the device."""
        return self.is_unstable().nonzero()[:, 0]

    def object_masses_kg(self) -> Float32[torch.Tensor, "slot object"]:
        """Mass of each object, as it is simulated [kg]."""
        return self._worlds["body_mass"][: self.size, self._layout.object_bodies]

    def object_frictions(self) -> Float32[torch.Tensor, "slot object"]:
        """Sliding friction of each object, as it is simulated."""
        return self._worlds["geom_friction"][: self.size, self._layout.object_geoms, 0]

    def contacts_in_use(self) -> tuple[int, int]:
        """Contacts, and pairs of geoms that came near, in all worlds at the last physics step; waits for the device."""
        return int(self._data.nacon.numpy()[0]), int(self._data.ncollision.numpy()[0])

    def constraints_in_use(self) -> int:
        """Most rows of constraints of a world at the last physics step; waits for the device."""
        return int(self._data.nefc.numpy().max())

    def _index(self, slots: Slots) -> Int[torch.Tensor, "slot"]:
        return torch.as_tensor(slots, dtype=torch.long, device=self.device)

    def _mesh_ids(self, scene: SceneModel) -> list[Int[np.ndarray, "_"]]:
        first_geoms = self._layout.first_geoms(scene)
        return [
            self.meshes.ids(asset, scene.model, int(first))
            for asset, first in zip(scene.assets, first_geoms, strict=True)
        ]

    def _launch(self, physics_steps: int) -> None:
        graph = self._graph(physics_steps)
        with on_device(self.device):
            warp.capture_launch(graph)

    def _graph(self, physics_steps: int) -> Any:
        """The control step as one launch; captured again when the meshes have moved."""
        if self._graph_revision != self.meshes.revision:
            self.meshes.attach(self._model)
            self._graph_revision = self.meshes.revision
            self._graphs.clear()
        if physics_steps not in self._graphs:
            self._graphs[physics_steps] = self._capture(physics_steps)
        return self._graphs[physics_steps]

    def _capture(self, physics_steps: int) -> Any:
        """Record steps; one is made first and undone, so that kernels are compiled before the recording."""
        before = self.save()
        with on_device(self.device):
            mujoco_warp.step(self._model, self._data)
            with warp.ScopedCapture() as capture:
                for _ in range(physics_steps):
                    mujoco_warp.step(self._model, self._data)
        self.restore(before, torch.ones(self.size, dtype=torch.bool, device=self.device))
        return capture.graph


def _allocate(layout: WorldLayout, worlds: int, sizes: BufferSizes, device: torch.device) -> tuple[Any, Any]:
    """The shared model with an own row of what differs for each world, and the worlds' data."""
    # A single world's missing meshes would be left in the collision test: they are looked at only where rows differ.
    rows = dict.fromkeys(WORLD_FIELDS, max(worlds, 2))
    with on_device(device):
        model = mujoco_warp.put_model(layout.model, batch_sizes=rows)
        model.opt.warn_overflow = 0
        return model, allocate_data(layout.model, worlds, sizes)
