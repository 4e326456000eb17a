"""Batches: the same for the same step, drawn as they should be, made in order in the background."""

import numpy as np
import pytest

from clutter6d.seeding import generator
from dapl_baselines.interactions.dataset import Transitions, open_interactions
from dapl_baselines.world_model.batches import BatchConfig, draw_rows, in_order, some_of, training_batch


def transitions(moving: int, still: int) -> Transitions:
    count = moving + still
    return Transitions(
        shard=np.zeros(count, int),
        row=np.arange(count),
        scene=np.zeros(count, int),
        is_moving=np.arange(count) < moving,
    )


@pytest.mark.parametrize(("moving", "still", "expected"), [(10, 90, 24), (0, 50, 0), (50, 0, 32)])
def test_moving_transitions_have_their_share_of_a_batch(moving, still, expected):
    drawn = draw_rows(transitions(moving, still), BatchConfig(rows=32, moving_share=0.75), generator(0))
    assert len(drawn) == 32
    assert (drawn < moving).sum() == expected


def test_a_batch_depends_on_seed_and_step_alone(pushed_boxes):
    data, config = open_interactions([pushed_boxes]), BatchConfig(rows=4)
    batch = training_batch(data, 7, config, seed=1)
    again = training_batch(open_interactions([pushed_boxes]), 7, config, seed=1)
    assert batch.now.equal(again.now)
    assert batch.later.equal(again.later)
    assert batch.flow.equal(again.flow)
    for step, seed in ((8, 1), (7, 2)):
        assert not batch.now.equal(training_batch(data, step, config, seed).now)


def test_every_transition_is_looked_at_once(pushed_boxes):
    data = open_interactions([pushed_boxes])
    batches = list(in_order(data, data.validation, rows=16))
    assert [len(batch.now) for batch in batches] == [16, 16, 8]
    np.testing.assert_array_equal(batches[2].now[0], data.clouds(data.validation[np.array([32])]).now[0])


def test_the_same_transitions_are_looked_at_every_time():
    every = transitions(5, 95)
    assert some_of(every, 10).row.tolist() == some_of(every, 10).row.tolist()
    assert len(set(some_of(every, 10).row)) == 10
    assert some_of(every, 1000).row.tolist() == every.row.tolist()
