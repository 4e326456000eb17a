"""Episodes of a policy as states and actions."""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.envs.observation import BodyState
from clutter6d.envs.slots import ClutterSlots
from clutter6d.envs.termination import Outcome
from clutter6d.eval.episode import EpisodeRecord
from clutter6d.eval.runner import EpisodeKey, EpisodeRunner
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import SceneModel
from dapl_baselines.interactions.states import pack_states


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Interaction:
    """One episode of ``n`` control steps.

    Attributes:
        key: Scene and goal pair.
        scene_model: The compiled scene.
        outcome: How it ended.
        states: Rows of :mod:`dapl_baselines.interactions.states`; the last one is after the last action.
        actions: Residuals asked for [rad]; row ``i`` led from state ``i`` to state ``i + 1``.
    """

    key: EpisodeKey
    scene_model: SceneModel
    outcome: Outcome
    states: Float64[np.ndarray, "state row"]
    actions: Float32[np.ndarray, "step 7"]


@dataclass(kw_only=True, slots=True, eq=False)
class _Trace:
    slot: int
    scene_model: SceneModel
    rows: list[Float64[np.ndarray, "row"]]


def shuffled_keys(keys: Sequence[EpisodeKey], seed: int) -> list[EpisodeKey]:
    """All episodes in the order in which they are recorded under a seed."""
    return [keys[index] for index in generator(seed, "interactions").permutation(len(keys))]


def record_episodes(runner: EpisodeRunner, keys: Sequence[EpisodeKey]) -> Iterator[Interaction]:
    """Run episodes and yield them; one that fails with its first step shows nothing and is left out.

    They come in the order of their keys, whichever ends first: so a recording that was stopped and goes on is the one
    that was not.

    Args:
        runner: What runs them.
        keys: Scene and goal pair of each.
    """
    traces, ended = dict[EpisodeKey, _Trace](), dict[EpisodeKey, Interaction | None]()
    waiting = deque(keys)
    for played in runner.rounds(keys):
        rows = _present_rows(played.env)
        for slot, attempt in played.running.items():
            key = attempt.episode.scene.scene_id, attempt.episode.pair_index
            if key not in traces:
                start = [_start_row(played.env, slot)]
                traces[key] = _Trace(slot=slot, scene_model=attempt.episode.scene_model, rows=start)
            if len(traces[key].rows) == len(attempt.actions):
                traces[key].rows.append(rows[slot])
        for record in played.finished:
            trace = traces.pop(record.row.key, None)
            ended[record.row.key] = trace and _finish(trace, record, rows)
        while waiting and waiting[0] in ended:
            episode = ended.pop(waiting.popleft())
            if episode is not None:
                yield episode


def _finish(trace: _Trace, record: EpisodeRecord, rows: Float64[np.ndarray, "slot row"]) -> Interaction:
    """The episode with its last state; an invalid step, which left the state as it was, is taken off."""
    if len(trace.rows) == record.row.steps:
        trace.rows.append(rows[trace.slot])
    steps = record.row.steps - (record.row.outcome == "unstable")
    return Interaction(
        key=record.row.key,
        scene_model=trace.scene_model,
        outcome=record.row.outcome,
        states=np.stack(trace.rows[: steps + 1]),
        actions=record.actions[:steps],
    )


def _present_rows(env: ClutterSlots) -> Float64[np.ndarray, "slot row"]:
    batch = env.batch
    state = BodyState(
        arm_qpos=batch.arm_qpos,
        arm_qvel=batch.arm_qvel,
        object_poses=batch.object_poses,
        object_velocities=batch.object_velocities,
    )
    return pack_states(state)


def _start_row(env: ClutterSlots, slot: int) -> Float64[np.ndarray, "row"]:
    """An episode starts at rest, with the arm at home; a slot's second one is first seen after its first step."""
    poses = env.start_poses[slot : slot + 1]
    start = BodyState(
        arm_qpos=HOME_QPOS[None].astype(np.float64),
        arm_qvel=np.zeros((1, len(HOME_QPOS))),
        object_poses=poses,
        object_velocities=np.zeros((1, poses.shape[1], 6)),
    )
    return pack_states(start)[0]
