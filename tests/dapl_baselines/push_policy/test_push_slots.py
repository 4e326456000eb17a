import numpy as np
import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from dapl_baselines.push_policy.push_slots import LOST_M, Ends, PushSlots
from tests.dapl_baselines.push_policy.drawn import make_push
from tests.dapl_baselines.teacher.small_teacher import small_scenes, small_shapes

SIZE, ALL = 3, np.arange(3)


def make_slots(max_steps: int = 50, seed: int = 0) -> PushSlots:
    config = EnvConfig(termination=TerminationConfig(max_steps=max_steps))
    slots = PushSlots(small_scenes(), small_shapes(), config, size=SIZE, seed=seed, threads=1)
    slots.tracker.begin(ALL, np.stack([make_push(1.0)] * SIZE), slots.see().state.poses[:, :3])
    return slots


def step_with_target_at(slots: PushSlots, slot: int, pose: np.ndarray) -> Ends:
    """One step after the target of one slot was put somewhere else, at rest."""
    batch = slots._episodes.core.batch
    states = batch.states.copy()
    batch.object_poses[slot, 0] = pose
    changed = batch.states[slot].copy()
    batch.put(ALL, states)
    batch.put(np.array([slot]), changed[None])
    return slots.step(slots.see(), np.ones(SIZE, dtype=bool))


def test_a_target_at_its_goal_is_a_success_and_ends_its_push_alone():
    slots = make_slots()
    ends = step_with_target_at(slots, 1, slots.see().goals[1])
    assert ends.is_success.tolist() == [False, True, False]
    assert not ends.is_drop.any()
    assert ends.is_over.tolist() == ends.push.tolist() == [False, True, False]


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_target_at_the_edge_is_taken_for_dropped(axis, side):
    slots = make_slots()
    pose = slots.see().state.poses[2].copy()
    pose[axis] = side * (LOST_M[axis] + 0.005)
    ends = step_with_target_at(slots, 2, pose)
    assert ends.is_drop.tolist() == ends.is_over.tolist() == [False, False, True]


def test_time_ends_episodes_and_pushes_without_a_drop():
    slots = make_slots(max_steps=1)
    ends = slots.step(slots.see(), np.ones(SIZE, dtype=bool))
    assert ends.is_over.all()
    assert ends.push.all()
    assert not (ends.is_drop | ends.is_success).any()


def test_only_slots_that_count_are_counted():
    slots = make_slots(max_steps=1)
    slots.step(slots.see(), np.array([True, False, True]))
    assert slots.tally.take().episodes == 2


def test_a_new_episode_is_seen_with_its_own_scene():
    slots = make_slots()
    slots.begin(ALL, [("boxes-0", 0), ("boxes-1", 0), ("boxes-0", 1)])
    seen, scenes = slots.see(), {scene.scene_id: scene for scene in small_scenes().scenes}
    for slot, (name, pair) in enumerate([("boxes-0", 0), ("boxes-1", 0), ("boxes-0", 1)]):
        goal = scenes[name].goal_pairs[pair]
        np.testing.assert_allclose(seen.state.poses[slot], goal.initial.as_row())
        np.testing.assert_allclose(seen.goals[slot], goal.goal.as_row())
        assert seen.targets[slot] == small_shapes().index[scenes[name].objects[0].asset_hash]
    assert slots.steps.tolist() == [0, 0, 0]


def test_slots_have_episodes_of_their_own_that_their_seed_names():
    drawn = {seed: make_slots(seed=seed).places for seed in (0, 1)}
    assert drawn[0] == make_slots(seed=0).places
    assert len({*drawn[0].seeds, *drawn[1].seeds}) == 6
