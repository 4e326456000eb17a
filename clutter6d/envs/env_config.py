"""Everything that decides what an environment does, in one frozen value."""

from dataclasses import dataclass, field

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.reward import RewardConfig
from clutter6d.envs.termination import TerminationConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class EnvConfig:
    """Actions, reward and termination of the environment."""

    action: ActionConfig = field(default_factory=ActionConfig)
    reward: RewardConfig = field(default_factory=RewardConfig)
    termination: TerminationConfig = field(default_factory=TerminationConfig)
