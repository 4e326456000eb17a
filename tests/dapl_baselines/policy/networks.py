"""Small networks and encoders that the tests of policies share."""

import torch

from dapl_baselines.encoders.corn import CornEncoderConfig
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import PolicyNetwork

SMALL_ENCODER = DaplEncoderConfig(patch_hidden_sizes=(8, 16), token_size=16, blocks=1, heads=2)
SMALL_CORN = CornEncoderConfig(patch_hidden_size=16, token_size=16, heads=2)
STATE_ONLY = PolicyNetworkConfig(fusion_sizes=(32, 16), head_sizes=(8,))
WITH_POINTS = STATE_ONLY.model_copy(update={"encoder": SMALL_ENCODER, "query_tokens": 2, "attention_heads": 2})
WITH_CORN = WITH_POINTS.model_copy(update={"encoder": SMALL_CORN})
WITH_MEMORY = WITH_POINTS.model_copy(update={"history": 3})


def make_network(config: PolicyNetworkConfig, seed: int = 0) -> PolicyNetwork:
    """A network whose weights the seed decides, in evaluation mode."""
    with torch.random.fork_rng():
        torch.manual_seed(seed)
        return PolicyNetwork(config).eval()


def make_inputs(config: PolicyNetworkConfig, rows: int, seed: int = 0) -> tuple[torch.Tensor, ...]:
    """States, and clouds if the network sees points."""
    generator = torch.Generator().manual_seed(seed)
    state = torch.randn(rows, config.state_size, generator=generator)
    return (state, 0.2 * torch.randn(rows, 1280, 7, generator=generator)) if config.encoder else (state,)


def count(module: torch.nn.Module) -> int:
    """Parameters."""
    return sum(parameter.numel() for parameter in module.parameters())
