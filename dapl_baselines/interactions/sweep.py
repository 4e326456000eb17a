"""The policy ``sweep``: push any object anywhere, with more or less noise, for as long as the episode lasts.

The world model must see contacts (paper, "Curriculum Learning with Policy Interaction"), and random residuals from the
home posture hardly ever make one. This policy draws an object and a place and face for it, pushes it once as the
planner's proposals do (:mod:`dapl_baselines.planners.pushes`), then draws again. It reads the true state and pursues
no task.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.assets.asset import Asset
from clutter6d.envs.action import ACTION_SIZE, ActionConfig
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput, PolicyOptions, identity_hash
from clutter6d.geometry import quat_from_yaw, quat_multiply
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import ARM_DOF, motion_in_states
from dapl_baselines.planners.config import PushConfig
from dapl_baselines.planners.contact_points import ContactPoints, sample_contact_points
from dapl_baselines.planners.pushes import Pushes, draw_pushes

_VERSION = 1
_SHARED = {"approach_speed", "min_height"}
_ROWS = tuple(item.name for item in dataclasses.fields(Pushes) if item.name not in _SHARED)
"""What each push has of its own."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SweepConfig:
    """What is pushed, where to, and how cleanly.

    Attributes:
        target_share: Share of the pushes that are at the target. The environment's points are those near it, so
            pushes at other objects are often out of sight.
        reach_m: Largest displacement along x and y that a push is meant for.
        region_m: Objects are pushed to places within these |x|, |y|: a hand's length inside the table's edge.
        noise_rad: Each push draws one of these standard deviations of noise on its residuals; with the largest,
            near the object, it is a random motion in contact.
        hover_clearance_m: Range of the height above the object at which the hand comes; below zero it may bump into
            that object or another on its way.
        max_steps: Control steps after which a push is given up.
        push: How pushes are drawn.
    """

    target_share: float = 0.7
    reach_m: float = 0.25
    region_m: tuple[float, float] = (0.30, 0.45)
    noise_rad: tuple[float, ...] = (0.0, 0.01, 0.03, 0.08)
    hover_clearance_m: tuple[float, float] = (-0.12, 0.04)
    max_steps: int = 40
    push: PushConfig = field(default_factory=PushConfig)


@dataclass(kw_only=True, slots=True, eq=False)
class _Drive:
    """A push under way in a slot: its control, the step at which it is given up, and the noise on it [rad]."""

    push: Pushes
    end: int
    noise_rad: float


class SweepPolicy:
    """One push after the other in every slot; slots cannot influence one another.

    Args:
        config: Settings.
    """

    name = "sweep"
    is_privileged = True
    needs_observation = False

    def __init__(self, config: SweepConfig | None = None) -> None:
        self.config = config or SweepConfig()
        self.policy_hash = identity_hash(f"{self.name}-{_VERSION}", dataclasses.asdict(self.config))
        self._contacts: dict[str, ContactPoints] = {}
        self._drives: dict[int, _Drive] = {}

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:  # noqa: ARG002
        """Slots in which episodes start draw a push at their first step."""
        for slot in slots.tolist():
            self._drives.pop(slot, None)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad], one row for each slot.

        Raises:
            InvalidValueError: The input lacks the simulation's states.
        """
        if inputs.states is None:
            raise InvalidValueError("the sweep is privileged: it needs the simulation's states in its input")
        qpos, _ = motion_in_states(inputs.states, inputs.episodes[0].scene_model.object_count)
        drives = [self._drive(inputs, row, qpos[row]) for row in range(len(qpos))]
        pushes = _joined([drive.push for drive in drives])
        noise = np.stack([drive.noise_rad * _noise(inputs, row) for row, drive in enumerate(drives)])
        residuals = pushes.residuals(qpos[:, :ARM_DOF]) + noise
        for row, drive in enumerate(drives):
            drive.push = _part(pushes, row)
        scale = ActionConfig().action_scale_rad
        return np.clip(residuals, -scale, scale).astype(np.float32)

    def _drive(self, inputs: PolicyInput, row: int, qpos: Float64[np.ndarray, "qpos"]) -> _Drive:
        """The push that is under way in a slot, or the next one."""
        slot, step = int(inputs.slots[row]), int(inputs.steps[row])
        drive = self._drives.get(slot)
        if drive is None or step >= drive.end or drive.push.is_over[0]:
            drive = self._drives[slot] = self._draw(inputs.episodes[row], step, qpos[ARM_DOF:].reshape(-1, 7))
        return drive

    def _draw(self, episode: Episode, step: int, poses: Float64[np.ndarray, "object 7"]) -> _Drive:
        rng = generator(episode.seed, "sweep", episode.scene.scene_id, episode.pair_index, step)
        assets, config = episode.scene_model.assets, self.config
        which = 0 if rng.random() < config.target_share else int(rng.integers(1, len(assets)))
        goal = _draw_goal(assets[which], poses[which], config, rng)
        style = dataclasses.replace(config.push, hover_clearance_m=float(rng.uniform(*config.hover_clearance_m)))
        push = draw_pushes(self._contacts_of(assets[which]), poses[which], goal, 1, style, rng)
        return _Drive(push=push, end=step + config.max_steps, noise_rad=float(rng.choice(config.noise_rad)))

    def _contacts_of(self, asset: Asset) -> ContactPoints:
        if asset.content_hash not in self._contacts:
            self._contacts[asset.content_hash] = sample_contact_points(asset)
        return self._contacts[asset.content_hash]


def make_sweep(options: PolicyOptions) -> SweepPolicy:  # noqa: ARG001  every factory takes the options
    """The policy ``sweep``."""
    return SweepPolicy()


def _draw_goal(
    asset: Asset, pose: Float64[np.ndarray, "7"], config: SweepConfig, rng: np.random.Generator
) -> Float64[np.ndarray, "7"]:
    """Somewhere near, within the region, on any of the object's stable faces, turned any way."""
    limits = np.array(config.region_m)
    place = np.clip(pose[:2] + rng.uniform(-config.reach_m, config.reach_m, size=2), -limits, limits)
    face = int(rng.integers(len(asset.stable.quats_wxyz)))
    quat = quat_multiply(quat_from_yaw(np.array(rng.uniform(-np.pi, np.pi))), asset.stable.quats_wxyz[face])
    return np.concatenate([place, asset.stable.heights_m[face : face + 1], quat])


def _noise(inputs: PolicyInput, row: int) -> Float64[np.ndarray, "7"]:
    """Unit noise of a slot's step."""
    episode, step = inputs.episodes[row], int(inputs.steps[row])
    return generator(episode.seed, "sweep_noise", episode.scene.scene_id, episode.pair_index, step).normal(
        size=ACTION_SIZE
    )


def _joined(pushes: Sequence[Pushes]) -> Pushes:
    """Pushes one after the other."""
    rows = {name: np.concatenate([getattr(push, name) for push in pushes]) for name in _ROWS}
    return dataclasses.replace(pushes[0], **rows)


def _part(pushes: Pushes, row: int) -> Pushes:
    return dataclasses.replace(pushes, **{name: getattr(pushes, name)[row : row + 1] for name in _ROWS})
