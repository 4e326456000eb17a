"""States, goals and pushes drawn at random, for tests that need many."""

import numpy as np

from clutter6d.geometry import quat_from_axis_angle, quat_from_yaw, quat_multiply, quat_to_matrix
from clutter6d.seeding import generator
from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.push_state import PushState
from dapl_baselines.push_policy.segments import draw_segments
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.whole_pushes import draw_whole_pushes
from tests.scene_fixtures import make_box_asset

BOX = make_box_asset("drawn", (0.06, 0.09, 0.14))
SHAPES = TargetShapes.of([BOX])


def draw_quats(count: int, rng: np.random.Generator) -> np.ndarray:
    quats = rng.normal(size=(count, 4))
    return quats / np.linalg.norm(quats, axis=1, keepdims=True)


def draw_poses(count: int, rng: np.random.Generator) -> np.ndarray:
    """Any rotation, anywhere above the table."""
    return np.hstack([rng.uniform([-0.3, -0.4, 0.05], [0.3, 0.4, 0.15], size=(count, 3)), draw_quats(count, rng)])


def draw_state(rows: int, obstacles: int = 3, seed: int = 0) -> PushState[np.ndarray]:
    """Targets, obstacles and hands anywhere, all in motion."""
    rng = generator(seed, "drawn states")
    around = [[-0.5, -0.7, 0.02, 0.03, 0.05], [0.5, 0.7, 0.2, 0.2, 2.0]]
    poses = draw_poses(rows, rng)
    tilt = quat_from_axis_angle(np.array([0.6, 0.8, 0.0]), rng.uniform(0, 1, rows))
    return PushState(
        poses=poses,
        velocities=rng.normal(size=(rows, 6)),
        obstacles=rng.uniform(*around, size=(rows, obstacles, 5)),
        physics=rng.uniform([0.05, 0.3], [2.0, 1.0], size=(rows, 2)),
        tips=poses[:, :3] + rng.uniform(-0.2, 0.2, size=(rows, 3)),
        tip_velocities=0.2 * rng.normal(size=(rows, 3)),
        hands=quat_multiply(tilt, quat_from_yaw(rng.uniform(-np.pi, np.pi, rows))),
    )


def draw_goals(rows: int, seed: int = 0) -> np.ndarray:
    return draw_poses(rows, generator(seed, "drawn goals"))


def draw_pushes(state: PushState[np.ndarray], goals: np.ndarray, each: int = 3, seed: int = 0) -> np.ndarray:
    """As many segments as whole pushes, of the box, wherever the hand is."""
    rotation, rng = quat_to_matrix(state.poses[:, 3:]).transpose(0, 2, 1), generator(seed, "drawn pushes")
    points, normals = SHAPES.contacts[[0]] @ rotation, SHAPES.normals[[0]] @ rotation
    segments = draw_segments(points, normals, state.tips - state.poses[:, :3], state.hands, each, rng)
    return np.concatenate([segments, draw_whole_pushes(state.poses, goals, points, normals, each, rng)], axis=1)


def surface(rows: int) -> np.ndarray:
    """Surface points of the box for each row."""
    return np.repeat(SHAPES.surface, rows, axis=0)


def make_push(side: float = 1.0, *, is_segment: bool = False) -> np.ndarray:
    """A push of a box 9 cm deep from its face on the side of +y (1) or -y (-1), towards its middle, 6 cm far."""
    push, normal = np.zeros(columns.SIZE), np.array([0.0, side, 0.0])
    push[columns.CONTACT], push[columns.NORMAL] = [0.0, 0.045 * side, -0.02], normal
    push[columns.DIRECTION], push[columns.START] = -normal, [0.0, 0.095 * side, -0.02]
    across, yaw = np.array([-side, 0.0, 0.0]), np.pi / 2
    push[columns.HAND] = quat_multiply(quat_from_axis_angle(across, 0.5), quat_from_yaw(yaw))
    push[columns.LENGTH], push[columns.SPEED], push[columns.IS_SEGMENT] = 0.06, 0.02, float(is_segment)
    return push
