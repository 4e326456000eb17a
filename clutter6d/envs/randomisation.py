"""Physics that differ from episode to episode: mass, friction, table height, latency of the commands."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float64

from clutter6d.errors import InvalidValueError
from clutter6d.physics import PHYSICS_STEP_S, PHYSICS_STEPS_PER_CONTROL_STEP
from clutter6d.sim.model_variation import vary_model
from clutter6d.sim.scene_model import SceneModel

Range = tuple[float, float]
_LIMITS: Final[dict[str, Range]] = {
    "mass_scale": (1e-3, 1e3),
    "friction_scale": (1e-2, 1e2),
    "table_height_m": (-0.2, 0.2),
    "latency_s": (0.0, PHYSICS_STEP_S * PHYSICS_STEPS_PER_CONTROL_STEP),
}


@dataclass(frozen=True, kw_only=True, slots=True)
class RandomisationConfig:
    """Ranges, lowest and highest value, that each episode draws its physics from; the defaults change nothing.

    The paper names no ranges; :data:`MODEST_RANDOMISATION` holds ours.

    Attributes:
        mass_scale: Factor of each object's mass and inertia, evenly spread in its logarithm.
        friction_scale: Factor of each object's friction, evenly spread in its logarithm.
        table_height_m: Height of the table's top [m], evenly spread; objects and goal move with it, the robot does not.
        latency_s: Time from a command to the joints' following it [s], in physics steps of 5 ms, evenly spread; the
            same throughout an episode, and at most one control step.
    """

    mass_scale: Range = (1.0, 1.0)
    friction_scale: Range = (1.0, 1.0)
    table_height_m: Range = (0.0, 0.0)
    latency_s: Range = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Refuse ranges that are none or that no physics has."""
        for name, (least, most) in _LIMITS.items():
            low, high = getattr(self, name)
            if not least <= low <= high <= most:
                raise InvalidValueError(
                    f"randomisation {name} from {low} to {high}: lower value first, both in [{least:g}, {most:g}]"
                )
        for latency in self.latency_s:
            if abs(latency - PHYSICS_STEP_S * round(latency / PHYSICS_STEP_S)) > 1e-9:
                raise InvalidValueError(
                    f"latency {latency} s is not a multiple of the physics step of {PHYSICS_STEP_S} s"
                )

    @property
    def varies_model(self) -> bool:
        """Whether an episode needs a model of its own."""
        return self.varies_table or (self.mass_scale, self.friction_scale) != ((1.0, 1.0), (1.0, 1.0))

    @property
    def varies_table(self) -> bool:
        """Whether the table may stand at another height."""
        return self.table_height_m != (0.0, 0.0)

    @property
    def delays_commands(self) -> bool:
        """Whether commands may come late."""
        return self.latency_s[1] > 0


MODEST_RANDOMISATION: Final = RandomisationConfig(
    mass_scale=(0.5, 2.0), friction_scale=(0.7, 1.4), table_height_m=(-0.02, 0.02), latency_s=(0.0, 0.04)
)
"""Masses within a factor of 2, as an estimate from a picture is; frictions within 1.4; a table that a tape has
measured; the latency of an arm that a network commands."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class PhysicsDraw:
    """The physics of one episode.

    Attributes:
        mass_scale: Factor of each object's mass.
        friction_scale: Factor of each object's friction.
        table_height_m: Height of the table's top [m].
        latency_steps: Physics steps of 5 ms for which the arm follows the command before.
    """

    mass_scale: Float64[np.ndarray, "object"]
    friction_scale: Float64[np.ndarray, "object"]
    table_height_m: float
    latency_steps: int


def draw_physics(config: RandomisationConfig, rng: np.random.Generator, objects: int) -> PhysicsDraw:
    """The physics of one episode; each value is drawn whether it varies or not, so that one range moves no other value.

    Args:
        config: The ranges.
        rng: From the seed, the scene, the pair and the episode's number.
        objects: Number of objects.
    """
    share = rng.random((2, objects))
    height, latency = rng.random(2)
    low, high = (round(latency_s / PHYSICS_STEP_S) for latency_s in config.latency_s)
    return PhysicsDraw(
        mass_scale=_between(config.mass_scale, share[0]),
        friction_scale=_between(config.friction_scale, share[1]),
        table_height_m=float(config.table_height_m[0] + height * np.ptp(config.table_height_m)),
        latency_steps=low + int(latency * (high - low + 1)),
    )


def vary_physics(scene: SceneModel, physics: PhysicsDraw) -> SceneModel:
    """The scene with an episode's masses, frictions and table height."""
    return vary_model(
        scene,
        mass_scale=physics.mass_scale,
        friction_scale=physics.friction_scale,
        table_height_m=physics.table_height_m,
    )


def _between(limits: Range, share: Float64[np.ndarray, "object"]) -> Float64[np.ndarray, "object"]:
    """Values at shares of the way from one limit to the other, on a logarithmic scale."""
    low, high = limits
    return low * (high / low) ** share
