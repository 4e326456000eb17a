"""The observation against plain loops over slots, objects and points."""

import math

import numpy as np
import pytest

from clutter6d.envs.observation import OBSERVATION_SHAPES, BodyState, Observation, TaskArrays, make_observation
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, end_effector_points, hand_jacobian, hand_pose
from clutter6d.sim.robot_facts import FINGER, HAND
from tests.scene_fixtures import make_box_scene

SLOTS, OBJECTS = 3, 4
SCENES = [make_box_scene(slot) for slot in range(SLOTS)]


def random_state() -> BodyState:
    rng = generator(0, "state")
    poses = rng.normal(scale=0.1, size=(SLOTS, OBJECTS, 7))
    poses[..., 3:] = rng.normal(size=(SLOTS, OBJECTS, 4))
    poses[..., 3:] /= np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    return BodyState(
        arm_qpos=HOME_QPOS + rng.normal(scale=0.2, size=(SLOTS, 7)),
        arm_qvel=rng.normal(size=(SLOTS, 7)),
        object_poses=poses,
        object_velocities=rng.normal(size=(SLOTS, OBJECTS, 6)),
    )


@pytest.fixture(scope="module")
def state() -> BodyState:
    return random_state()


@pytest.fixture(scope="module")
def task() -> TaskArrays:
    made = TaskArrays.allocate(SLOTS, OBJECTS)
    for slot, (scene, model) in enumerate(SCENES):
        made.load(slot, model, scene.goal_pairs[1].goal)
    return made


@pytest.fixture(scope="module")
def observation(state, task) -> Observation:
    return make_observation(state, task, np.arange(SLOTS * 7, dtype=np.float32).reshape(SLOTS, 7))


def matrix(quat: list[float]) -> list[list[float]]:
    w, x, y, z = quat
    return [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]


def apply(rows: list[list[float]], vector: list[float]) -> list[float]:
    return [sum(row[i] * vector[i] for i in range(3)) for row in rows]


def cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(a: list[float], b: list[float]) -> list[float]:
    return [x + y for x, y in zip(a, b, strict=True)]


def features_of(
    points: np.ndarray, pose: list[float], linear: list[float], spin: list[float], mass: float
) -> list[list[float]]:
    """Feature rows of a body whose origin moves with ``linear`` and which turns with ``spin``, world frame."""
    rows = []
    for point in points.tolist():
        lever = apply(matrix(pose[3:]), point)
        rows.append([*add(lever, pose[:3]), mass / len(points), *add(linear, cross(spin, lever))])
    return rows


def object_rows(state: BodyState, slot: int, index: int) -> list[list[float]]:
    model = SCENES[slot][1]
    pose, velocity = state.object_poses[slot, index].tolist(), state.object_velocities[slot, index].tolist()
    spin = apply(matrix(pose[3:]), velocity[3:])
    mass = float(model.object_masses_kg()[index])
    return features_of(model.assets[index].surface_points, pose, velocity[:3], spin, mass)


def test_there_is_one_row_a_slot_of_the_papers_shapes(observation):
    assert {name: value.shape for name, value in observation.items()} == {
        name: (SLOTS, *shape) for name, shape in OBSERVATION_SHAPES.items()
    }
    assert all(value.dtype == np.float32 for value in observation.values())


def test_object_points_are_those_of_the_target(state, observation):
    for slot in range(SLOTS):
        np.testing.assert_allclose(observation["object_points"][slot], object_rows(state, slot, 0), atol=2e-6)


def test_environment_points_are_the_nearest_by_sorting(state, observation):
    for slot in range(SLOTS):
        target = object_rows(state, slot, 0)
        centre = [sum(row[i] for row in target) / len(target) for i in range(3)]
        obstacles = [row for index in range(1, OBJECTS) for row in object_rows(state, slot, index)]
        distances = [math.dist(row[:3], centre) for row in obstacles]
        nearest = sorted(sorted(range(len(obstacles)), key=lambda i: distances[i])[:512])
        np.testing.assert_allclose(observation["environment_points"][slot], [obstacles[i] for i in nearest], atol=2e-6)


def test_end_effector_points_move_with_the_hand(state, observation):
    mass = HAND.mass_kg + 2 * FINGER.mass_kg
    hands, jacobians = hand_pose(state.arm_qpos), hand_jacobian(state.arm_qpos)
    for slot in range(SLOTS):
        twist = [sum(jacobians[slot, i, j] * state.arm_qvel[slot, j] for j in range(7)) for i in range(6)]
        rows = features_of(end_effector_points(), hands[slot].tolist(), twist[:3], twist[3:], mass)
        np.testing.assert_allclose(observation["end_effector_points"][slot], rows, atol=2e-6)


def test_states_are_positions_and_the_first_two_columns_of_the_rotation(state, task, observation):
    hands = hand_pose(state.arm_qpos)
    for slot in range(SLOTS):
        hand, target, goal = hands[slot].tolist(), state.object_poses[slot, 0].tolist(), task.goals[slot].tolist()
        columns = list(zip(*matrix(hand[3:]), strict=True))
        np.testing.assert_allclose(observation["hand_state"][slot], [*hand[:3], *columns[0], *columns[1]], atol=1e-6)
        back = list(zip(*matrix(target[3:]), strict=True))
        offset = [goal[i] - target[i] for i in range(3)]
        first, second = (apply(matrix(goal[3:]), [row[axis] for row in back]) for axis in range(2))
        np.testing.assert_allclose(observation["relative_goal"][slot], [*offset, *first, *second], atol=1e-6)
        joints = [*state.arm_qpos[slot].tolist(), *state.arm_qvel[slot].tolist()]
        np.testing.assert_allclose(observation["joint_state"][slot], joints, atol=1e-6)


def test_an_observation_keeps_its_values_when_the_world_moves_on(task):
    state, actions = random_state(), np.zeros((SLOTS, 7), dtype=np.float32)
    observation = make_observation(state, task, actions)
    before = {name: value.copy() for name, value in observation.items()}
    for live in (state.arm_qpos, state.arm_qvel, state.object_poses, state.object_velocities, actions, task.physics):
        live += 1
    task.physics[:] -= 1
    for name, value in observation.items():
        assert np.array_equal(value, before[name]), name
