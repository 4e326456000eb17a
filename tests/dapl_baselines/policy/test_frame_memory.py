import numpy as np
import torch

from clutter6d.seeding import generator
from dapl_baselines.policy.frame_memory import FrameMemory


def test_it_gives_the_last_frames_of_the_episode_of_each_slot_and_zeros_before():
    """Against a list for each slot, with slots that come and go at random."""
    memory, rng, history = FrameMemory(3, 2), generator(0, "memory"), 3
    lists: dict[int, list[np.ndarray]] = {}
    for _ in range(60):
        new = np.array([slot for slot in range(5) if slot not in lists or rng.random() < 0.2], dtype=np.int64)
        memory.forget(new)
        lists |= {slot: [] for slot in new.tolist()}
        slots = rng.permutation(5)[: rng.integers(1, 6)]
        steps = np.array([len(lists[slot]) for slot in slots.tolist()])
        frames = rng.random((len(slots), 2), dtype=np.float32)
        for slot, frame in zip(slots.tolist(), frames, strict=True):
            lists[slot].append(frame)
        empty = [np.zeros(2, dtype=np.float32)] * history
        expected = [(empty + lists[slot])[-history:] for slot in slots.tolist()]
        assert torch.equal(memory.remember(slots, steps, frames), torch.from_numpy(np.array(expected)))


def test_asked_twice_at_the_same_step_it_is_not_told_of_a_further_frame():
    memory, slots, one = FrameMemory(2, 1), np.array([4]), np.ones((1, 1), dtype=np.float32)
    for frame in (5, 6):
        window = memory.remember(slots, np.array([0]), frame * one)
        assert window.flatten().tolist() == [0, frame]
    assert memory.remember(slots, np.array([1]), one).flatten().tolist() == [6, 1]


def test_an_episode_that_is_taken_up_midway_has_only_the_frames_since():
    memory, slots, one = FrameMemory(2, 1), np.array([0]), np.ones((1, 1), dtype=np.float32)
    memory.remember(slots, np.array([6]), 7 * one)
    memory.forget(slots)
    assert memory.remember(slots, np.array([7]), one).flatten().tolist() == [0, 1]
