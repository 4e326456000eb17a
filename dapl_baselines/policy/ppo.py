"""Actor, critic and PPO for rsl_rl's runner, which finds them by ``"dapl_baselines.policy.ppo:Class"``.

The paper's pipeline is unified: actor and critic are two heads on one representation ``g``. rsl_rl makes two models and
gives both their parameters to one optimiser, which must not see any twice. So the actor owns the trunk; the critic owns
its head alone and reads the actor's ``g``. The trunk then learns from both losses, is clipped with the actor's
gradients, and runs once for both. Its own option for sharing, ``share_cnn_encoders``, is for images.

Observations are a ``TensorDict`` of ``state`` (``s_env``) and, with an encoder, ``tokens`` (``Z``), encoded when they
were observed: the encoder is frozen, so that no epoch encodes again.
"""

from typing import Any, Final, cast

import torch
from jaxtyping import Float
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel
from rsl_rl.modules.distribution import GaussianDistribution
from tensordict import TensorDict
from torch import Tensor, nn

from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import PolicyNetwork, Trunk, make_head, make_log_std

STATE_KEY: Final = "state"
TOKENS_KEY: Final = "tokens"


class PolicyActor(MLPModel):
    """The trunk and the actor's head, with a Gaussian whose standard deviations are parameters.

    Args:
        obs: One observation, for the sizes.
        obs_groups: Entries of the observation of each model; both see all.
        obs_set: ``"actor"``.
        output_dim: Numbers in an action.
        network: The configuration of the network, as plain values.
    """

    def __init__(
        self, obs: TensorDict, obs_groups: dict[str, list[str]], obs_set: str, output_dim: int, *, network: Any
    ) -> None:
        # Of the base class, only what it offers for a distribution is of use: its layers are not made.
        nn.Module.__init__(self)
        config = PolicyNetworkConfig.model_validate(network)
        self.trunk = Trunk(config, obs[TOKENS_KEY].shape[-1] if TOKENS_KEY in obs_groups[obs_set] else None)
        self.head = make_head(config, output_dim)
        self.distribution = GaussianDistribution(output_dim, std_type="log")
        self.log_std = self.distribution.log_std_param = make_log_std(config)
        self._last: tuple[TensorDict | None, Tensor | None] = None, None

    def forward(self, obs: TensorDict, *, stochastic_output: bool = False, **_: Any) -> Float[Tensor, "row action"]:
        """The mean action in units of the action scale; or a sample, after which the distribution can be asked."""
        fused = self._fuse(obs)
        self._last = obs, fused
        mean = self.head(fused)
        if not stochastic_output:
            return mean
        self.distribution.update(mean)
        return self.distribution.sample()

    def fuse_once(self, obs: TensorDict) -> Float[Tensor, "row fused"]:
        """``g``: that of the last forward pass, once, if it saw these very observations; else computed."""
        (seen, fused), self._last = self._last, (None, None)
        return fused if fused is not None and seen is obs else self._fuse(obs)

    def update_normalization(self, obs: TensorDict) -> None:
        """Take the observations of a rollout into account; in distributed training, those of all processes."""
        rows = obs[STATE_KEY]
        if torch.distributed.is_available() and torch.distributed.is_initialized():
            parts = [torch.empty_like(rows) for _ in range(torch.distributed.get_world_size())]
            torch.distributed.all_gather(parts, rows.contiguous())
            rows = torch.cat(parts)
        self.trunk.statistics.update(rows)

    def _fuse(self, obs: TensorDict) -> Float[Tensor, "row fused"]:
        return self.trunk(obs[STATE_KEY], obs.get(TOKENS_KEY, None))


class PolicyCritic(MLPModel):
    """The critic's head on the actor's ``g``.

    Args:
        _obs: One observation.
        _obs_groups: Entries of the observation of each model.
        _obs_set: ``"critic"``.
        output_dim: 1.
        network: The configuration of the network, as plain values.
    """

    def __init__(self, _obs: Any, _obs_groups: Any, _obs_set: str, output_dim: int, *, network: Any) -> None:
        nn.Module.__init__(self)
        self.head = make_head(PolicyNetworkConfig.model_validate(network), output_dim)
        self._actors: list[PolicyActor] = []

    def read_from(self, actor: PolicyActor) -> None:
        """Use an actor's trunk; in a list, it does not count as part of this module."""
        self._actors = [actor]

    def forward(self, obs: TensorDict, **_: Any) -> Float[Tensor, "row 1"]:
        """The value of each row."""
        return self.head(self._actors[0].fuse_once(obs))

    def update_normalization(self, obs: TensorDict) -> None:
        """The actor does that."""


class UnifiedPPO(PPO):
    """rsl_rl's PPO, with the critic on the actor's trunk.

    Args:
        actor: Owns the trunk.
        critic: Reads from it.
        storage: The rollout.
        options: rsl_rl's.
    """

    def __init__(self, actor: PolicyActor, critic: PolicyCritic, storage: Any, **options: Any) -> None:
        critic.read_from(actor)
        super().__init__(actor, critic, storage, **options)


def begin_with(network: PolicyNetwork, algorithm: UnifiedPPO) -> None:
    """Put a network's weights in the place of random ones, all but its encoder's: state query, fusion, heads and std.

    Args:
        network: Made as the algorithm's models are.
        algorithm: What goes on with them.
    """
    actor, critic = cast(PolicyActor, algorithm.actor), cast(PolicyCritic, algorithm.critic)
    actor.trunk.load_state_dict(network.trunk.state_dict())
    actor.head.load_state_dict(network.actor.state_dict())
    critic.head.load_state_dict(network.critic.state_dict())
    with torch.no_grad():
        actor.log_std.copy_(network.log_std)


def assemble(config: PolicyNetworkConfig, algorithm: UnifiedPPO, encoder: nn.Module | None) -> PolicyNetwork:
    """A network of its own with the weights as they are now, on the CPU.

    Args:
        config: Of the network.
        algorithm: What trains it.
        encoder: The frozen encoder, if it has one.
    """
    actor, critic = cast(PolicyActor, algorithm.actor), cast(PolicyCritic, algorithm.critic)
    with torch.random.fork_rng(devices=[]):
        network = PolicyNetwork(config)
    network.trunk.load_state_dict(actor.trunk.state_dict())
    network.actor.load_state_dict(actor.head.state_dict())
    network.critic.load_state_dict(critic.head.state_dict())
    if network.encoder is not None and encoder is not None:
        network.encoder.load_state_dict(encoder.state_dict())
    with torch.no_grad():
        network.log_std.copy_(actor.log_std)
    return network.eval()
