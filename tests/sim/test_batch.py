"""States that are put into a batch, where objects may sleep and where they may not."""

import numpy as np
import pytest

from clutter6d.scene import GoalPair
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.kinematics import inverse_kinematics
from clutter6d.sim.model_variation import let_sleep
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import SceneModel
from tests.scene_fixtures import make_box_scene

DOWN = (0.0, 1.0, 0.0, 0.0)
SLOTS = np.arange(2)


@pytest.fixture(scope="module", params=["awake", "may sleep"])
def boxes(request) -> tuple[GoalPair, SceneModel]:
    scene, model = make_box_scene()
    return scene.goal_pairs[0], let_sleep(model) if request.param == "may sleep" else model


def sweep(batch: SceneBatch, pair: GoalPair, steps: range) -> np.ndarray:
    """All states, step by step, while hands sweep the targets along +y after half a second of rest."""
    start, states = pair.initial.position, []
    for step in steps:
        if step >= 5:
            hand = [start[0], start[1] - 0.12 + 0.02 * (step - 5), start[2] + 0.11, *DOWN]
            joints, reached = inverse_kinematics(np.array([hand]), batch.arm_qpos[0].copy())
            assert reached.all()
            batch.joint_targets[:] = joints
        batch.step()
        states.append(batch.states.copy())
    return np.stack(states)


def make_batch(boxes, threads: int = 1) -> SceneBatch:
    pair, model = boxes
    batch = SceneBatch([model] * 2, threads=threads)
    start = pair.initial.position
    joints, _ = inverse_kinematics(np.array([[start[0], start[1] - 0.12, start[2] + 0.11, *DOWN]]), HOME_QPOS)
    batch.reset(SLOTS, np.stack([pair.object_poses] * 2), joints[0])
    return batch


def test_what_is_touched_wakes_up(boxes):
    batch = make_batch(boxes)
    sweep(batch, boxes[0], range(14))
    moved = np.linalg.norm(batch.object_poses[0, :, :3] - boxes[0].object_poses[:, :3], axis=1)
    assert moved[0] > 0.03
    assert (moved[2:] < 1e-3).all()


@pytest.mark.parametrize("paused", [4, 8])
def test_a_state_that_is_put_back_goes_on_as_in_a_fresh_batch_to_the_bit(boxes, paused):
    """Also where objects slept before: they are awake in both."""
    pair = boxes[0]
    batch, fresh = make_batch(boxes), make_batch(boxes, threads=2)
    sweep(batch, pair, range(paused))
    state = batch.states.copy()
    sweep(batch, pair, range(paused, paused + 4))
    batch.put(SLOTS, state)
    fresh.put(SLOTS, state)
    steps = range(paused, paused + 6)
    assert np.array_equal(sweep(batch, pair, steps), sweep(fresh, pair, steps))


def test_putting_some_slots_leaves_the_others_as_they_were(boxes):
    pair = boxes[0]
    batch, alone = make_batch(boxes), make_batch(boxes)
    for each in (batch, alone):
        sweep(each, pair, range(6))
    batch.put(np.array([1]), batch.states[[1]] * 1.0)
    assert np.array_equal(sweep(batch, pair, range(6, 10))[:, 0], sweep(alone, pair, range(6, 10))[:, 0])


def test_a_slot_that_is_reset_is_as_new(boxes):
    pair = boxes[0]
    batch, fresh = make_batch(boxes), make_batch(boxes)
    sweep(batch, pair, range(12))
    for each in (batch, fresh):
        each.reset(SLOTS, np.stack([pair.object_poses] * 2))
    assert np.array_equal(sweep(batch, pair, range(4)), sweep(fresh, pair, range(4)))
