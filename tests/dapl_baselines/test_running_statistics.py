import numpy as np
import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.running_statistics import RunningStatistics


def make_values(rows: int = 1000) -> torch.Tensor:
    values = generator(0, "values").normal(loc=[1, -2, 3, 0.5], scale=[0.1, 0.2, 0.3, 4], size=(rows, 4))
    return torch.from_numpy(values.astype(np.float32))


def test_batches_of_any_size_give_the_statistics_of_all_values():
    values, statistics = make_values(), RunningStatistics(groups=(1, 1, 1, 1))
    for batch in values.split([1, 9, 490, 500]):
        statistics.update(batch)
    assert torch.allclose(statistics.mean, values.mean(dim=0), atol=1e-5)
    assert torch.allclose(statistics.scale, values.std(dim=0, correction=0), rtol=1e-5)
    assert int(statistics.count) == 1000
    seen = statistics(values)
    assert torch.allclose(seen.mean(dim=0), torch.zeros(4), atol=1e-4)
    assert torch.allclose(seen.std(dim=0, correction=0), torch.ones(4), atol=1e-4)
    assert torch.allclose(statistics.undo(seen), values, atol=1e-5)


def test_features_of_a_group_share_the_root_mean_square_of_their_deviations():
    values, statistics = make_values(), RunningStatistics(groups=(3, 1))
    statistics.update(values)
    shared = values[:, :3].var(dim=0, correction=0).mean().sqrt()
    assert torch.allclose(statistics.scale[:3], shared.expand(3))
    assert torch.allclose(statistics.scale[3], values[:, 3].std(correction=0))


def test_before_the_first_update_nothing_is_changed():
    values = make_values()
    assert torch.equal(RunningStatistics(groups=(4,))(values), values)


@pytest.mark.parametrize("constant", [0.0, 0.3, 1e-4, -1234.5])
def test_constant_features_become_zero_and_never_nan(constant):
    statistics = RunningStatistics(groups=(1,))
    for _ in range(3):
        statistics.update(torch.full((100, 1), constant))
    assert torch.equal(statistics.scale, torch.ones(1))
    assert torch.allclose(statistics(torch.full((5, 1), constant)), torch.zeros(5, 1), atol=1e-4)


def test_rounding_noise_about_zero_is_not_brought_to_scale():
    noise = 1e-12 * torch.randn(100, 1, generator=torch.Generator().manual_seed(0))
    statistics = RunningStatistics(groups=(1,))
    statistics.update(noise)
    assert torch.equal(statistics.scale, torch.ones(1))
    assert statistics(noise).abs().max() < 1e-10


def test_in_evaluation_mode_and_from_no_values_nothing_is_learned():
    statistics = RunningStatistics(groups=(4,))
    statistics.update(make_values()[:0])
    statistics.eval().update(make_values())
    assert int(statistics.count) == 0
    assert torch.equal(statistics.mean, torch.zeros(4))


def test_statistics_are_saved_with_the_weights_and_are_no_parameters():
    statistics = RunningStatistics(groups=(4,))
    assert set(statistics.state_dict()) == {"mean", "variance", "count"}
    assert not list(statistics.parameters())
