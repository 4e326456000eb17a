"""Episodes made up of drawn states: what a replay would hold of them."""

from pathlib import Path

import numpy as np

from clutter6d.seeding import generator
from dapl_baselines.push_policy.push_state import PushState
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.transitions import NO_LATER, Transitions
from tests.dapl_baselines.push_policy.drawn import draw_goals, draw_pushes, draw_state

KEPT = 2_000


def draw_transitions(rows: int, seed: int = 0) -> Transitions:
    """Each of an episode of its own; a target's mass and friction do not change in it."""
    before, after, rng = draw_state(rows, seed=seed), draw_state(rows, seed=seed + 1), generator(seed, "transitions")
    after = PushState(**{name: getattr(after, name) for name in after.__slots__} | {"physics": before.physics})
    goals = draw_goals(rows, seed)
    return Transitions(
        before=before,
        after=after,
        goals=goals,
        pushes=draw_pushes(before, goals, 1, seed)[:, seed % 2],
        steps=rng.integers(1, 40, rows),
        is_success=rng.random(rows) < 0.2,
        is_drop=rng.random(rows) < 0.2,
        targets=np.zeros(rows, dtype=np.int64),
        later=np.full(rows, NO_LATER),
        weights=np.ones(rows),
    )


def fill(folder: Path, transitions: Transitions, kept: int = KEPT) -> Replay:
    """A replay that holds them."""
    rows = transitions.to_rows()
    replay = Replay(folder, rows, kept)
    replay.add(rows)
    return replay
