"""Everything that decides what an environment does, in one frozen value."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.cameras import CameraConfig
from clutter6d.envs.noise import NoiseConfig
from clutter6d.envs.randomisation import RandomisationConfig
from clutter6d.envs.reward import RewardConfig
from clutter6d.envs.termination import TerminationConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvConfig:
    """Actions, observation, physics, reward and termination; the defaults are the benchmark's.

    Attributes:
        action: How actions become joint targets.
        reward: Scales and weights of the reward.
        termination: When an episode ends.
        noise: How wrong the observation is.
        randomisation: Ranges that each episode draws its physics from.
        mass_scale: Factor of the mass of objects by name, for instance ``{"large_0": 100.0}`` (paper, "More Analysis
            on Adaptive Behavior").
        has_object_states: Whether the observation has the true state of every object, ``object_states``.
        cameras: Cameras whose pictures the observation has.
    """

    action: ActionConfig = field(default_factory=ActionConfig)
    reward: RewardConfig = field(default_factory=RewardConfig)
    termination: TerminationConfig = field(default_factory=TerminationConfig)
    noise: NoiseConfig = field(default_factory=NoiseConfig)
    randomisation: RandomisationConfig = field(default_factory=RandomisationConfig)
    mass_scale: Mapping[str, float] = field(default_factory=dict[str, float])
    has_object_states: bool = False
    cameras: tuple[CameraConfig, ...] = ()
