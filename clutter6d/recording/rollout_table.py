"""The columns of recorded rollouts: one table of control steps, one of episodes.

A row of the steps' table holds what was seen before the action, the action, and what came of it. What was seen after
an episode's last action stands in the episodes' table, in columns that begin with ``final_``.
"""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np
import pyarrow as pa

from clutter6d.envs.action import ACTION_SIZE
from clutter6d.envs.reward import RewardTerms
from clutter6d.envs.termination import GoalErrors
from clutter6d.eval.episode import TIMING_PREFIX, EpisodeRow
from clutter6d.recording.rollout import REWARD_TERMS, PointClouds, Rollout, RolloutStates

STATE_SIZES = {"hand_state": 9, "joint_state": 14, "relative_goal": 9, "physics_parameters": 5, "previous_action": 7}
OBJECT_SIZES = {"object_poses": 7, "object_velocities": 6}
CLOUD_SHAPES = {"object_points": (512, 7), "environment_points": (512, 7), "end_effector_points": (256, 7)}
ERROR_COLUMNS = {
    "position_error_m": "position_m",
    "planar_error_m": "planar_m",
    "rotation_error_rad": "rotation_rad",
}
FINAL_PREFIX = "final_"
_ROW_TYPES: dict[object, pa.DataType] = {str: pa.string(), int: pa.int64(), float: pa.float64(), bool: pa.bool_()}


def state_schema(objects: int, *, point_clouds: bool) -> pa.Schema:
    """The columns of one state; arrays are stored flat, row by row."""
    columns = [(name, pa.list_(pa.float32(), size)) for name, size in STATE_SIZES.items()]
    columns += [(name, pa.list_(pa.float64(), objects * size)) for name, size in OBJECT_SIZES.items()]
    if point_clouds:
        columns += [(name, pa.list_(pa.float32(), int(np.prod(shape)))) for name, shape in CLOUD_SHAPES.items()]
    return pa.schema(columns)


def step_schema(objects: int, *, point_clouds: bool) -> pa.Schema:
    """The columns of the steps' table."""
    numbers = [*(f"reward_{term}" for term in REWARD_TERMS), "reward", *ERROR_COLUMNS]
    flags = ["is_success", "is_terminated", "is_truncated"]
    return pa.schema(
        [
            ("scene_id", pa.string()),
            ("pair", pa.int64()),
            ("step", pa.int64()),
            *state_schema(objects, point_clouds=point_clouds),
            ("action", pa.list_(pa.float32(), ACTION_SIZE)),
            *((name, pa.float64()) for name in numbers),
            *((name, pa.bool_()) for name in flags),
        ]
    )


def episode_schema(objects: int, *, point_clouds: bool) -> pa.Schema:
    """The columns of the episodes' table."""
    final = state_schema(objects, point_clouds=point_clouds)
    return pa.schema(
        [
            *((name, _row_type(name)) for name in row_columns()),
            ("task", pa.string()),
            ("object_names", pa.list_(pa.string())),
            *((FINAL_PREFIX + field.name, field.type) for field in final),
        ]
    )


def row_columns() -> tuple[str, ...]:
    """The columns of an evaluation's table that a rollout keeps: all but the timing."""
    return tuple(name for name in EpisodeRow.model_fields if not name.startswith(TIMING_PREFIX))


def step_table(rollout: Rollout) -> pa.Table:
    """An episode's rows of the steps' table."""
    row, count = rollout.row, len(rollout.actions)
    is_last = np.arange(count) == count - 1
    columns: dict[str, object] = {
        "scene_id": [row.scene_id] * count,
        "pair": [row.pair] * count,
        "step": np.arange(count),
        **state_columns(rollout.states, slice(0, count)),
        "action": _flat(rollout.actions),
        **{f"reward_{term}": getattr(rollout.rewards, term) for term in REWARD_TERMS},
        "reward": rollout.rewards.total,
        **{column: getattr(rollout.errors, name) for column, name in ERROR_COLUMNS.items()},
        "is_success": is_last & row.is_success,
        "is_terminated": is_last & (row.outcome != "timeout"),
        "is_truncated": is_last & (row.outcome == "timeout"),
    }
    clouds = rollout.states.clouds is not None
    return pa.table(columns, schema=step_schema(len(rollout.object_names), point_clouds=clouds))


def episode_table(rollout: Rollout) -> pa.Table:
    """An episode's one row of the episodes' table."""
    final = state_columns(rollout.states, slice(-1, None))
    columns: dict[str, object] = {
        **{name: [getattr(rollout.row, name)] for name in row_columns()},
        "task": [rollout.task],
        "object_names": [list(rollout.object_names)],
        **{FINAL_PREFIX + name: values for name, values in final.items()},
    }
    clouds = rollout.states.clouds is not None
    return pa.table(columns, schema=episode_schema(len(rollout.object_names), point_clouds=clouds))


def state_columns(states: RolloutStates, rows: slice) -> dict[str, pa.Array]:
    """Some states as columns."""
    clouds = {} if states.clouds is None else {name: getattr(states.clouds, name) for name in CLOUD_SHAPES}
    arrays = {name: getattr(states, name) for name in (*STATE_SIZES, *OBJECT_SIZES)} | clouds
    return {name: _flat(values[rows]) for name, values in arrays.items()}


def to_row(episode: Mapping[str, object]) -> EpisodeRow:
    """How an episode ended, from its row of the episodes' table.

    Raises:
        ValueError: The values are none that an episode can have.
    """
    return EpisodeRow.model_validate({name: episode[name] for name in row_columns()} | {"timing_seconds": 0.0})


def to_rollout(steps: pa.Table, episode: Mapping[str, object]) -> Rollout:
    """An episode from its rows of both tables.

    Raises:
        ValueError: Cells are empty, or do not fit each other.
    """
    names = episode["object_names"]
    if not isinstance(names, list):
        raise ValueError("an episode has no names of objects")  # noqa: TRY004
    states = {name: _states(steps, episode, name, (size,), np.float32) for name, size in STATE_SIZES.items()}
    for name, size in OBJECT_SIZES.items():
        states[name] = _states(steps, episode, name, (len(names), size), np.float64)
    clouds = None
    if set(CLOUD_SHAPES) <= set(steps.column_names):
        shapes = CLOUD_SHAPES.items()
        clouds = PointClouds(**{name: _states(steps, episode, name, shape, np.float32) for name, shape in shapes})
    return Rollout(
        row=to_row(episode),
        task=str(episode["task"]),
        object_names=tuple(names),
        states=RolloutStates(**states, clouds=clouds),
        actions=_rows(steps, "action").reshape(-1, ACTION_SIZE),
        rewards=RewardTerms(**{term: _rows(steps, f"reward_{term}") for term in REWARD_TERMS}),
        errors=GoalErrors(**{item.name: _rows(steps, _error_column(item.name)) for item in fields(GoalErrors)}),
    )


def _states(
    steps: pa.Table, episode: Mapping[str, object], name: str, shape: tuple[int, ...], dtype: type[np.floating]
) -> np.ndarray:
    final = np.array(episode[FINAL_PREFIX + name], dtype=dtype)
    return np.concatenate([_rows(steps, name), final]).reshape(-1, *shape)


def _rows(steps: pa.Table, name: str) -> np.ndarray:
    """A column's numbers, lists of them one after another."""
    column = steps.column(name).combine_chunks()
    values = column.flatten() if pa.types.is_fixed_size_list(column.type) else column
    if column.null_count or values.null_count:
        raise ValueError(f"column {name} has empty cells")
    return values.to_numpy(zero_copy_only=False).copy()


def _flat(array: np.ndarray) -> pa.Array:
    """An array's rows as lists of one length."""
    return pa.FixedSizeListArray.from_arrays(pa.array(array.reshape(-1)), int(np.prod(array.shape[1:])))


def _error_column(name: str) -> str:
    return next(column for column, field in ERROR_COLUMNS.items() if field == name)


def _row_type(name: str) -> pa.DataType:
    return _ROW_TYPES.get(EpisodeRow.model_fields[name].annotation, pa.string())
