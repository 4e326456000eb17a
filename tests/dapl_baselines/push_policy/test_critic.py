import numpy as np
import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.push_policy import critic as critic_module
from dapl_baselines.push_policy.choice import judge
from dapl_baselines.push_policy.critic import MOTION_SIZE, Judgement, PushCritic, PushCriticConfig
from dapl_baselines.push_policy.push_frame import POINT_FEATURES, PushView, feature_count, view_pushes
from dapl_baselines.push_policy.target_shapes import SURFACE_POINTS
from tests.dapl_baselines.push_policy.drawn import draw_goals, draw_pushes, draw_state, surface

SMALL = PushCriticConfig(point_sizes=(8, 12), hidden_size=16)
ROWS = 5


def make_critic(config: PushCriticConfig = SMALL) -> PushCritic:
    """With an output that says something, which a fresh critic's does not."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        critic = PushCritic(config)
        torch.nn.init.normal_(critic.output.weight)
    return critic.eval()


def make_view(each: int = 4) -> PushView:
    state, goals = draw_state(ROWS), draw_goals(ROWS)
    pushes = draw_pushes(state, goals, each)
    arrays = (np.asarray(array, dtype=np.float32) for array in (goals, surface(ROWS), pushes))
    return view_pushes(state.to_tensors(), *(torch.from_numpy(array) for array in arrays))


def outputs(judgement: Judgement) -> torch.Tensor:
    return torch.cat([judgement.gain[..., None], judgement.future[..., None], judgement.motion], dim=-1).detach()


def linear(inputs: int, units: int) -> int:
    return (inputs + 1) * units


@pytest.mark.parametrize(("obstacles", "points", "hidden"), [(3, (64, 64), 256), (0, (8, 12), 16), (11, (16, 8), 32)])
def test_it_has_the_parameters_of_its_layers(obstacles, points, hidden):
    critic = PushCritic(PushCriticConfig(obstacles=obstacles, point_sizes=points, hidden_size=hidden))
    features = feature_count(obstacles)
    seen = linear(features, points[0]) + linear(POINT_FEATURES, points[0]) + linear(points[0], points[1])
    after = linear(features + points[1], hidden) + 2 * hidden + 2 * linear(hidden, hidden)
    expected = seen + after + linear(hidden, 2 + MOTION_SIZE)
    assert sum(parameter.numel() for parameter in critic.parameters()) == expected


def test_the_laptops_critic_fits_into_a_repository():
    assert sum(parameter.numel() for parameter in PushCritic(PushCriticConfig()).parameters()) < 250_000


def test_a_fresh_critic_expects_nothing_of_any_push():
    assert (outputs(PushCritic(SMALL)(make_view())) == 0).all()


def test_judging_in_parts_is_judging_at_once(monkeypatch):
    critic, view = make_critic(), make_view()
    at_once = outputs(critic(view))
    monkeypatch.setattr(critic_module, "PUSHES_AT_ONCE", 7)
    torch.testing.assert_close(outputs(critic(view)), at_once, atol=1e-5, rtol=1e-5)


def test_judgements_follow_their_pushes():
    critic, view = make_critic(), make_view()
    order = torch.from_numpy(generator(0, "order").permutation(8))
    moved = PushView(features=view.features[:, order], points=view.points[:, order])
    torch.testing.assert_close(outputs(critic(moved)), outputs(critic(view))[:, order], atol=1e-5, rtol=1e-5)


def test_the_order_of_surface_points_does_not_matter():
    critic, view = make_critic(), make_view()
    order = torch.from_numpy(generator(0, "order").permutation(SURFACE_POINTS))
    moved = PushView(features=view.features, points=view.points[:, :, order])
    torch.testing.assert_close(outputs(critic(moved)), outputs(critic(view)), atol=1e-5, rtol=1e-5)


def test_every_push_is_judged_by_its_own_features_and_points():
    critic, view = make_critic(), make_view()
    features, points = view.features.clone(), view.points.clone()
    features[0, 1] += 1
    points[2, 3] += 1
    changed = (outputs(critic(PushView(features=features, points=points))) != outputs(critic(view))).any(dim=-1)
    assert changed.nonzero().tolist() == [[0, 1], [2, 3]]


def test_what_a_decision_is_made_by_is_what_the_push_brings_and_what_comes_after():
    state, goals = draw_state(ROWS), draw_goals(ROWS)
    pushes, critic = draw_pushes(state, goals), make_critic()
    values = judge(critic, state, goals, surface(ROWS), pushes)
    judged = critic(make_view(3))
    assert (values.shape, values.dtype) == ((ROWS, 6), np.float32)
    np.testing.assert_allclose(values, (judged.gain + judged.future).detach(), atol=1e-6)
