from collections.abc import Sequence

import numpy as np
import pytest

from clutter6d.envs.slots import ClutterSlots
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.seeding import generator
from dapl_baselines.planners.config import PlannerConfig
from dapl_baselines.planners.predictive_sampling import PredictiveSamplingPolicy, is_on_course
from dapl_baselines.planners.pushes import draw_pushes
from dapl_baselines.planners.rollouts import RolloutSimulator
from tests.scene_fixtures import make_box_scene

TINY = PlannerConfig(samples=12, horizon_steps=6, commit_steps=3, attempts=1, max_rounds=2, improvement=-10.0)
SMALL = PlannerConfig(max_rounds=40)


def _episode(index: int = 0, pair_index: int = 0, seed: int = 0) -> Episode:
    scene, model = make_box_scene(index)
    return Episode(scene=scene, pair_index=pair_index, scene_model=model, seed=seed)


def _start(episodes: Sequence[Episode]) -> ClutterSlots:
    models = [episode.scene_model for episode in episodes]
    env = ClutterSlots(models, threads=1)
    env.load(np.arange(len(episodes)), models, [episode.pair for episode in episodes])
    return env


def _input(env: ClutterSlots, episodes: Sequence[Episode], step: int) -> PolicyInput:
    slots = np.arange(len(episodes))
    return PolicyInput(
        slots=slots,
        episodes=tuple(episodes),
        steps=np.full(len(episodes), step),
        observation=None,
        states=env.batch.states.copy(),
    )


def _run(policy: PredictiveSamplingPolicy, episodes: Sequence[Episode], steps: int) -> np.ndarray:
    env, slots = _start(episodes), np.arange(len(episodes))
    policy.begin(slots, episodes)
    made = []
    for step in range(steps):
        made.append(policy.act(_input(env, episodes, step)))
        env.step(slots, made[-1])
    return np.stack(made)


def test_actions_do_not_depend_on_the_slots_beside_nor_on_threads():
    episodes = [_episode(0, 0), _episode(1, 1), _episode(1, 0)]
    together = _run(PredictiveSamplingPolicy(TINY, threads=2), episodes, 8)
    for slot, episode in enumerate(episodes):
        alone = _run(PredictiveSamplingPolicy(TINY, threads=1), [episode], 8)
        np.testing.assert_array_equal(together[:, slot], alone[:, 0])


def test_another_seed_gives_other_actions():
    first, second = (_run(PredictiveSamplingPolicy(TINY, threads=1), [_episode(seed=seed)], 3) for seed in (0, 1))
    assert not np.array_equal(first, second)


def test_the_planner_solves_an_easy_push_as_predicted():
    episode = _episode()
    env, slots, policy = _start([episode]), np.array([0]), PredictiveSamplingPolicy(SMALL, threads=1)
    policy.begin(slots, [episode])
    for step in range(150):
        env.step(slots, policy.act(_input(env, [episode], step)))
        errors = env.errors(slots)
        if errors.position_m[0] < 0.05 and errors.rotation_rad[0] < 0.1:
            return
    pytest.fail(f"not reached: {errors}")


def test_after_its_rounds_are_spent_the_arm_stands_still():
    actions = _run(PredictiveSamplingPolicy(TINY, threads=1), [_episode()], 10)
    assert np.abs(actions[:3]).max() > 0
    assert not actions[-1].any()


def test_a_plan_is_dropped_when_an_object_is_moved_by_another_hand():
    episode = _episode()
    env = _start([episode])
    before = env.batch.states[0].copy()
    assert is_on_course(episode.scene_model, before, before, SMALL)
    env.batch.object_poses[0, 1, 0] += 0.001
    assert is_on_course(episode.scene_model, before, env.batch.states[0], SMALL)
    env.batch.object_poses[0, 1, 0] += 0.02
    assert not is_on_course(episode.scene_model, before, env.batch.states[0], SMALL)


def test_the_policy_hash_names_the_settings():
    assert PredictiveSamplingPolicy(TINY).policy_hash != PredictiveSamplingPolicy(SMALL).policy_hash
    assert (
        PredictiveSamplingPolicy(TINY, threads=1).policy_hash == PredictiveSamplingPolicy(TINY, threads=2).policy_hash
    )


def test_an_input_without_states_is_refused():
    episode = _episode()
    policy = PredictiveSamplingPolicy(TINY)
    policy.begin(np.array([0]), [episode])
    blind = PolicyInput(slots=np.array([0]), episodes=(episode,), steps=np.array([0]), observation=None, states=None)
    with pytest.raises(InvalidValueError, match="privileged"):
        policy.act(blind)


@pytest.mark.parametrize(
    "settings", [{"samples": 1}, {"commit_steps": 24}, {"commit_steps": 0}, {"attempts": 0}, {"knots": 1}]
)
def test_settings_with_which_nothing_can_run_are_refused(settings):
    with pytest.raises(InvalidValueError):
        PlannerConfig(**settings)


def test_rollouts_know_a_goal_reached_and_an_object_fallen():
    scene, model = make_box_scene(0)
    simulator = RolloutSimulator(model, scene.goal_pairs[0], TINY, threads=1)
    env = _start([_episode()])
    env.batch.object_poses[0, 0] = simulator.goal
    at_goal = env.batch.states[0].copy()
    env.batch.object_poses[0, 1, :3] = (0.9, 0.0, -0.2)
    fallen = env.batch.states[0].copy()
    still = np.zeros((TINY.samples - TINY.pushes, TINY.horizon_steps, 7))
    pushes = draw_pushes(
        simulator.contacts, scene.goal_pairs[0].initial.as_row(), simulator.goal, TINY.pushes, TINY.push, generator(0)
    )
    assert simulator.is_dropped(fallen)
    assert not simulator.is_dropped(at_goal)
    assert simulator.run(at_goal, still, pushes, 0.8).success_step[0] == 0
