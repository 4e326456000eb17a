"""What a LeRobot data set (format v3.0) of rollouts holds, and an episode's frames in that form.

A frame is a control step: what was seen before the action, the action, and under ``next.`` what came of it.
"""

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from clutter6d.physics import CONTROL_STEP_S
from clutter6d.recording.rollout import Rollout
from clutter6d.recording.rollout_table import CLOUD_SHAPES
from clutter6d.sim.robot import JOINT_NAMES

FPS = round(1 / CONTROL_STEP_S)
IMAGE_PREFIX = "observation.images."
CLOUD_PREFIX = "observation."
INDEX_FEATURES = ("frame_index", "episode_index", "index", "task_index")
Feature = dict[str, object]

_AXES = ("x", "y", "z")
_ROTATION = tuple(f"rotation_{row}{column}" for column in (1, 2) for row in (1, 2, 3))
_POSE_9D = (*_AXES, *_ROTATION)
STATE_NAMES = (
    *(f"hand.{name}" for name in _POSE_9D),
    *(f"{joint}.position" for joint in JOINT_NAMES),
    *(f"{joint}.velocity" for joint in JOINT_NAMES),
    *(f"relative_goal.{name}" for name in _POSE_9D),
    *(f"{joint}.previous_action" for joint in JOINT_NAMES),
)
"""Components of ``observation.state``; ``rotation_21`` is row 2, column 1 of a rotation matrix."""


def make_features(
    objects: int, *, cameras: Sequence[str] = (), width: int = 0, height: int = 0, point_clouds: bool = False
) -> dict[str, Feature]:
    """The ``features`` of ``meta/info.json``.

    Args:
        objects: Objects in a scene.
        cameras: Names of the cameras.
        width: Of their pictures [px].
        height: Of their pictures [px].
        point_clouds: Whether frames have point clouds.
    """
    bodies = ("target", *(f"obstacle_{number}" for number in range(1, objects)))
    poses = [f"{body}.{name}" for body in bodies for name in (*_AXES, "qw", "qx", "qy", "qz")]
    features = {
        "observation.state": _vector(STATE_NAMES),
        "observation.environment_state": _vector(poses),
        "action": _vector([f"{joint}.residual" for joint in JOINT_NAMES]),
        "next.reward": _scalar("float32"),
        **{f"next.{name}": _scalar("bool") for name in ("done", "success", "truncated")},
    }
    if point_clouds:
        for name, shape in CLOUD_SHAPES.items():
            features[CLOUD_PREFIX + name] = {"dtype": "float32", "shape": list(shape), "names": ["point", "feature"]}
    for camera in cameras:
        features[IMAGE_PREFIX + camera] = _video(width, height)
    return features | {"timestamp": _scalar("float32")} | {name: _scalar("int64") for name in INDEX_FEATURES}


def frame_arrays(rollout: Rollout) -> dict[str, np.ndarray]:
    """An episode's frames by feature, without pictures and without what depends on the other episodes."""
    count, states = len(rollout.actions), rollout.states
    parts = (states.hand_state, states.joint_state, states.relative_goal, states.previous_action)
    is_last = np.arange(count) == count - 1
    arrays = {
        "observation.state": np.concatenate(parts, axis=1)[:-1],
        "observation.environment_state": states.object_poses[:-1].reshape(count, -1).astype(np.float32),
        "action": rollout.actions,
        "next.reward": rollout.rewards.total.astype(np.float32),
        "next.done": is_last,
        "next.success": is_last & rollout.row.is_success,
        "next.truncated": is_last & (rollout.row.outcome == "timeout"),
    }
    if states.clouds is not None:
        arrays |= {CLOUD_PREFIX + name: getattr(states.clouds, name)[:-1] for name in CLOUD_SHAPES}
    frame = np.arange(count, dtype=np.int64)
    return arrays | {"timestamp": (frame / FPS).astype(np.float32), "frame_index": frame}


def frame_table(arrays: dict[str, np.ndarray]) -> pa.Table:
    """Frames as a table: vectors as lists of fixed length, matrices as lists of lists."""
    return pa.table({name: _column(array) for name, array in arrays.items()})


def _column(array: np.ndarray) -> pa.Array:
    if array.ndim == 1:
        return pa.array(array)
    if array.ndim == 2:
        return pa.FixedSizeListArray.from_arrays(pa.array(array.reshape(-1)), array.shape[1])
    rows = _lists(pa.array(array.reshape(-1)), array.shape[2])
    return _lists(rows, array.shape[1])


def _lists(values: pa.Array, size: int) -> pa.Array:
    return pa.ListArray.from_arrays(pa.array(np.arange(0, len(values) + 1, size, dtype=np.int32)), values)


def _vector(names: Sequence[str]) -> Feature:
    return {"dtype": "float32", "shape": [len(names)], "names": list(names)}


def _scalar(dtype: str) -> Feature:
    return {"dtype": dtype, "shape": [1], "names": None}


def _video(width: int, height: int) -> Feature:
    info = {
        "video.height": height,
        "video.width": width,
        "video.codec": "h264",
        "video.pix_fmt": "yuv420p",
        "video.is_depth_map": False,
        "video.fps": FPS,
        "video.channels": 3,
        "has_audio": False,
    }
    return {"dtype": "video", "shape": [height, width, 3], "names": ["height", "width", "channels"], "info": info}
