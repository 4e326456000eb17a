import pytest
import torch
from pydantic import ValidationError

from clutter6d.errors import InvalidValueError
from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import STATE_BOUND, PolicyNetwork, StateCrossAttention
from tests.dapl_baselines.policy.networks import (
    STATE_ONLY,
    WITH_CORN,
    WITH_MEMORY,
    WITH_POINTS,
    count,
    make_inputs,
    make_network,
)


def test_the_papers_state_has_44_numbers_and_each_part_can_be_left_out():
    assert PolicyNetworkConfig().state_size == 9 + 14 + 9 + 5 + 7
    without = PolicyNetworkConfig(state_parts=("hand_state", "joint_state", "relative_goal", "previous_action"))
    assert without.state_size == 39
    assert (without.is_privileged, PolicyNetworkConfig().is_privileged) == (False, True)
    teacher = PolicyNetworkConfig(state_parts=("relative_goal", "object_states"), objects=4)
    assert (teacher.state_size, teacher.is_privileged) == (9 + 4 * 15, True)


def test_a_part_is_found_in_the_state():
    config = PolicyNetworkConfig(state_parts=("joint_state", "object_states", "hand_state"), objects=4)
    assert config.columns_of("object_states") == slice(14, 74)
    assert config.columns_of("hand_state") == slice(74, 83) == slice(74, config.state_size)


@pytest.mark.parametrize(
    "wrong",
    [
        {"state_parts": ("joint_state",), "encoder": {"name": "corn"}},
        {"state_parts": ("hand_state", "hand_state")},
        {"state_parts": ()},
        {"state_parts": ("object_states",)},
        {"objects": 4},
        {"query_tokens": 0},
        {"fusion_sizes": (10**6,)},
        {"encoder": {"name": "corm"}},
        {"history": 0},
        {"history": 17},
        {"history": 2, "fusion_sizes": (18,)},
    ],
)
def test_a_configuration_that_makes_no_network_is_refused(wrong):
    with pytest.raises(ValidationError):
        PolicyNetworkConfig.model_validate(wrong)


def test_heads_must_divide_the_tokens():
    with pytest.raises(InvalidValueError, match="attention_heads is 3"):
        StateCrossAttention(44, 128, 1, 3)


@pytest.mark.parametrize("queries", [1, 16])
def test_parameter_counts_are_those_of_the_layers_of_the_paper(queries):
    network = PolicyNetwork(PolicyNetworkConfig(encoder=DaplEncoderConfig(blocks=1), query_tokens=queries))
    s, d = 44, 128
    attention = (s + 1) * queries * d + d * d + 2 * (d + 1) * d
    fusion = (queries * d + s + 1) * 512 + 513 * 256 + 257 * 128
    assert count(network.trunk.attention) == attention
    assert count(network.trunk) == attention + fusion
    assert (count(network.actor), count(network.critic)) == (129 * 64 + 65 * 7, 129 * 64 + 65)
    assert network.log_std.shape == (7,)


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, WITH_CORN])
@torch.no_grad()
def test_without_a_history_it_is_the_trunk_and_the_heads(config):
    network, (state, *points) = make_network(config), make_inputs(config, 5)
    assert not any(name.startswith("over_time") for name in network.state_dict())
    fused = network.trunk(state, *(network.encoder(cloud, state[:, :9]) for cloud in points))
    assert torch.equal(network(state, *points), 0.1 * network.actor(fused).clamp(-1, 1))
    assert torch.equal(network.fuse(network.window(network.see(state, *points))), fused)


def test_a_history_leaves_all_other_weights_as_they_would_be_drawn():
    weights, others = (make_network(config).state_dict() for config in (WITH_POINTS, WITH_MEMORY))
    assert all(torch.equal(others[name], tensor) for name, tensor in weights.items())


@torch.no_grad()
def test_what_is_remembered_counts():
    network, memory = make_network(WITH_MEMORY), torch.zeros(4, 2, 17)
    actions = network(*make_inputs(WITH_MEMORY, 4))
    assert torch.equal(network(*make_inputs(WITH_MEMORY, 4), memory), actions)
    memory[1, 1] = network.see(*make_inputs(WITH_MEMORY, 1, seed=1))[0]
    changed = network(*make_inputs(WITH_MEMORY, 4), memory)
    assert [torch.equal(one, other) for one, other in zip(actions, changed, strict=True)] == [True, False, True, True]


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, WITH_CORN])
def test_residuals_stay_within_the_action_scale(config):
    network, inputs = make_network(config), make_inputs(config, 5)
    with torch.no_grad():
        network.actor[-1].weight.mul_(100)
        residuals = network(*inputs)
    assert residuals.shape == (5, 7)
    assert residuals.abs().max() == torch.tensor(0.1)


@pytest.mark.parametrize("config", [STATE_ONLY, WITH_POINTS, WITH_CORN])
@torch.no_grad()
def test_rows_do_not_see_each_other(config):
    network, inputs = make_network(config), make_inputs(config, 4)
    others = tuple(torch.cat([rows[:1], -rows[1:]]) for rows in inputs)
    torch.testing.assert_close(network(*inputs)[0], network(*others)[0])
    assert not torch.allclose(network(*inputs)[1], network(*others)[1])


@torch.no_grad()
def test_both_the_state_and_the_points_count():
    network, (state, cloud) = make_network(WITH_POINTS), make_inputs(WITH_POINTS, 3)
    assert not torch.allclose(network(state, cloud), network(state, 2 * cloud))
    assert not torch.allclose(network(state, cloud), network(2 * state, cloud))


@pytest.mark.parametrize("heads", [1, 2])
@torch.no_grad()
def test_cross_attention_is_the_weighted_sum_of_values_that_each_query_asks_for(heads):
    attention = StateCrossAttention(5, 4, queries=3, heads=heads)
    state, tokens = torch.randn(2, 5), torch.randn(2, 6, 4)
    found, part = attention(state, tokens).unflatten(1, (3, 4)), 4 // heads
    for row in range(2):
        keys, values = attention.to_keys(tokens[row]), attention.to_values(tokens[row])
        for query, asked in enumerate(attention.to_queries(state[row]).split(4)):
            heard = [
                torch.softmax(keys[:, own] @ asked[own] / part**0.5, dim=0) @ values[:, own]
                for own in (slice(head * part, (head + 1) * part) for head in range(heads))
            ]
            torch.testing.assert_close(found[row, query], attention.project(torch.cat(heard)))


@torch.no_grad()
def test_the_state_is_normalised_by_what_training_saw_and_clipped():
    network = make_network(STATE_ONLY)
    seen = 5 + 3 * torch.randn(1000, STATE_ONLY.state_size)
    network.trunk.train().statistics.update(seen)
    network.eval()
    torch.testing.assert_close(network.trunk.statistics(seen).std(dim=0), torch.ones(44), atol=1e-2, rtol=0)
    far = torch.full((1, 44), 1e6)
    bound = network.trunk.statistics.undo(torch.full((1, 44), STATE_BOUND))
    torch.testing.assert_close(network(far), network(bound))
