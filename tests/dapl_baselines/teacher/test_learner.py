from dataclasses import replace

import numpy as np
import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.learner import MOTION_SCALE_PER_M, TeacherLearner, motions
from dapl_baselines.teacher.settings import GoalSettings
from dapl_baselines.teacher.transitions import Transitions
from tests.dapl_baselines.push_policy.drawn import SHAPES, make_push
from tests.dapl_baselines.teacher.small_teacher import SETTINGS
from tests.dapl_baselines.teacher.stories import draw_transitions, fill

OWN_GOALS = SETTINGS.model_copy(update={"goals": GoalSettings(later_share=0, moved_share=0)})


def with_poses(state: PushState[np.ndarray], poses: np.ndarray) -> PushState[np.ndarray]:
    return PushState(**{name: getattr(state, name) for name in STATE_FIELDS} | {"poses": poses})


def longer_is_better(rows: int) -> Transitions:
    """From one state, one push of many lengths, which brings the target its length nearer to the goal."""
    drawn, pushes = draw_transitions(rows), np.tile(make_push(1.0), (rows, 1))
    pushes[:, columns.LENGTH] = generator(0, "lengths").uniform(0, 0.2, rows)
    before = drawn.before.rows(np.zeros(rows, dtype=np.int64))
    before.poses[:, 0] = -0.3
    after = before.poses.copy()
    after[:, 0] += pushes[:, columns.LENGTH]
    nothing = np.zeros(rows, dtype=bool)
    return replace(
        drawn,
        before=before,
        after=with_poses(before, after),
        goals=before.poses + [0.3, 0, 0, 0, 0, 0, 0],
        pushes=pushes,
        steps=np.full(rows, 10),
        is_success=nothing,
        is_drop=nothing,
    )


def test_it_learns_that_what_pushes_bring_depends_on_their_length(tmp_path):
    changes = {"batch": 64, "updates": 40, "learning_rate": 5e-3, "future_weight": 0.0}
    settings = OWN_GOALS.model_copy(update=changes)
    replay = fill(tmp_path, longer_is_better(400))
    learner = TeacherLearner(settings, SHAPES)
    losses = [learner.learn(replay, 400, generator(0, "learning", part)) for part in range(4)]
    assert losses[0].unexplained > 0.5
    assert losses[-1].unexplained < 0.3
    assert losses[-1].gain < 0.5 * losses[0].gain
    assert learner.updates == 160


@pytest.fixture
def replay(tmp_path) -> Replay:
    return fill(tmp_path, draw_transitions(40))


def weights(module: torch.nn.Module) -> torch.Tensor:
    return torch.cat([parameter.detach().flatten() for parameter in module.parameters()])


def test_the_slow_copy_follows_by_its_share(replay):
    learner = TeacherLearner(SETTINGS.model_copy(update={"updates": 1, "target_rate": 0.25}), SHAPES)
    start = weights(learner.slow)
    assert torch.equal(weights(learner.critic), start)
    for part in range(2):
        slow = weights(learner.slow)
        learner.learn(replay, 40, generator(0, "learning", part))
        expected = slow + 0.25 * (weights(learner.critic) - slow)
        torch.testing.assert_close(weights(learner.slow), expected)
    assert not torch.equal(weights(learner.slow), start)


def test_the_learning_rate_falls_in_a_straight_line_and_stays(replay):
    rates = {"learning_rate": 1e-2, "final_learning_rate": 2e-3, "falling_updates": 4}
    learner, seen = TeacherLearner(SETTINGS.model_copy(update={"updates": 1, **rates}), SHAPES), []
    for part in range(6):
        learner.learn(replay, 40, generator(0, "learning", part))
        seen.append(learner.optimizer.param_groups[0]["lr"])
    np.testing.assert_allclose(seen, [1e-2, 8e-3, 6e-3, 4e-3, 2e-3, 2e-3])


def test_what_is_learned_depends_on_the_random_numbers_and_the_rows_alone(replay):
    one, other = (TeacherLearner(SETTINGS, SHAPES) for _ in range(2))
    assert one.learn(replay, 40, generator(0, "same")) == other.learn(replay, 40, generator(0, "same"))
    assert torch.equal(weights(one.critic), weights(other.critic))


@pytest.mark.parametrize("there", [100, 995, 1_300])
def test_what_is_added_until_the_next_state_changes_nothing(tmp_path, there):
    """Practice adds rows meanwhile, and after a kill those of iterations that must be made again are there."""
    end, rows = there, draw_transitions(there)
    once, later = (fill(tmp_path / name, rows, SETTINGS.kept) for name in ("once", "later"))
    later.add(draw_transitions(SETTINGS.rows_at_risk, seed=7).to_rows())
    one, other = (TeacherLearner(SETTINGS, SHAPES) for _ in range(2))
    assert one.learn(once, end, generator(0, "same")) == other.learn(later, end, generator(0, "same"))


def test_motions_are_told_in_the_frame_of_the_push():
    """A target that is pushed along -y, and goes there by 5 cm while it turns about the vertical."""
    drawn, push = draw_transitions(1), make_push(1.0)[None]
    before = np.array([[0.1, 0.2, 0.07, 1.0, 0, 0, 0]])
    after = np.array([[0.1, 0.15, 0.07, np.cos(0.2), 0, 0, np.sin(0.2)]])
    moved = replace(drawn, before=with_poses(drawn.before, before), after=with_poses(drawn.after, after), pushes=push)
    expected = [[0.05 * MOTION_SCALE_PER_M, 0, 0, 0, 0, 0.4]]
    np.testing.assert_allclose(motions(moved).numpy(), expected, atol=1e-5)
