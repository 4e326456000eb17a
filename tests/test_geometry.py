"""Poses and rotations: checked against SciPy's independent implementation and against their own algebra."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from clutter6d import geometry
from clutter6d.geometry import (
    Pose,
    is_unit,
    motion_between,
    quat_conjugate,
    quat_from_axis_angle,
    quat_from_matrix,
    quat_from_yaw,
    quat_multiply,
    quat_normalize,
    quat_to_matrix,
    rotate,
    rotation_6d,
    rotation_error_rad,
    transform_points,
)
from clutter6d.seeding import generator

seeds = st.integers(min_value=0, max_value=2**32 - 1)
angles = st.floats(min_value=-np.pi, max_value=np.pi)


def random_quats(seed: int, *shape: int) -> np.ndarray:
    return quat_normalize(generator(seed, "quaternions").normal(size=(*shape, 4)))


def random_poses(seed: int, *shape: int) -> np.ndarray:
    positions = generator(seed, "positions").uniform(-1, 1, (*shape, 3))
    return np.concatenate([positions, random_quats(seed, *shape)], axis=-1)


def scipy_rotation(quats_wxyz: np.ndarray) -> Rotation:
    return Rotation.from_quat(quats_wxyz, scalar_first=True)


def assert_same_rotation(actual: np.ndarray, expected: np.ndarray, tolerance: float = 1e-12) -> None:
    signs = np.where((actual * expected).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    np.testing.assert_allclose(actual * signs, expected, atol=tolerance)


@given(seeds)
def test_product_and_rotation_agree_with_scipy(seed: int) -> None:
    a, b = random_quats(seed, 8), random_quats(seed + 1, 8)
    points = generator(seed, "points").normal(size=(8, 3))
    assert_same_rotation(quat_multiply(a, b), (scipy_rotation(a) * scipy_rotation(b)).as_quat(scalar_first=True))
    np.testing.assert_allclose(rotate(a, points), scipy_rotation(a).apply(points), atol=1e-12)


@given(seeds)
def test_product_is_associative_and_the_conjugate_is_the_inverse(seed: int) -> None:
    a, b, c = (random_quats(seed + i, 5) for i in range(3))
    np.testing.assert_allclose(quat_multiply(quat_multiply(a, b), c), quat_multiply(a, quat_multiply(b, c)), atol=1e-12)
    identity = np.broadcast_to(np.array(geometry.IDENTITY_QUAT), a.shape)
    np.testing.assert_allclose(quat_multiply(a, quat_conjugate(a)), identity, atol=1e-12)


@given(seeds)
def test_rotating_twice_is_rotating_by_the_product(seed: int) -> None:
    a, b = random_quats(seed), random_quats(seed + 1)
    points = generator(seed, "points").normal(size=(6, 3))
    np.testing.assert_allclose(rotate(quat_multiply(a, b), points), rotate(a, rotate(b, points)), atol=1e-12)


@given(seeds)
def test_matrix_agrees_with_scipy_and_comes_back(seed: int) -> None:
    quats = random_quats(seed, 3, 4)
    matrices = quat_to_matrix(quats)
    np.testing.assert_allclose(matrices.reshape(-1, 3, 3), scipy_rotation(quats.reshape(-1, 4)).as_matrix(), atol=1e-12)
    returned = quat_from_matrix(matrices)
    assert (returned[..., 0] >= 0).all()
    assert_same_rotation(returned, quats)


@given(st.sampled_from([0, 1, 2]), st.floats(min_value=-1e-6, max_value=1e-6))
def test_half_turns_come_back_from_their_matrix(axis: int, deviation: float) -> None:
    quat = quat_from_axis_angle(np.eye(3)[axis], np.pi + deviation)
    assert_same_rotation(quat_from_matrix(quat_to_matrix(quat)), quat)


@given(seeds, angles)
def test_axis_angle_and_yaw_agree_with_scipy(seed: int, angle: float) -> None:
    axis = generator(seed, "axis").normal(size=3)
    axis /= np.linalg.norm(axis)
    expected = Rotation.from_rotvec(angle * axis).as_quat(scalar_first=True)
    assert_same_rotation(quat_from_axis_angle(axis, angle), expected)
    np.testing.assert_allclose(quat_from_yaw(angle), quat_from_axis_angle(np.array([0.0, 0.0, 1.0]), angle), atol=1e-15)


@given(seeds)
def test_rotation_error_is_a_distance_between_rotations(seed: int) -> None:
    a, b, c = (random_quats(seed + i, 16) for i in range(3))
    error = rotation_error_rad(a, b)
    assert ((error >= 0) & (error <= np.pi)).all()
    np.testing.assert_array_equal(error, rotation_error_rad(b, a))
    np.testing.assert_array_equal(error, rotation_error_rad(-a, b))
    assert (rotation_error_rad(a, c) <= error + rotation_error_rad(b, c) + 1e-6).all()
    np.testing.assert_allclose(error, (scipy_rotation(a).inv() * scipy_rotation(b)).magnitude(), atol=1e-6)


@given(seeds, st.floats(min_value=1e-3, max_value=np.pi))
def test_rotation_error_is_the_angle_of_the_rotation_between(seed: int, angle: float) -> None:
    quat = random_quats(seed)
    turned = quat_multiply(quat_from_axis_angle(np.array([0.0, 1.0, 0.0]), angle), quat)
    assert rotation_error_rad(quat, turned) == pytest.approx(angle, abs=1e-9)


def test_rotation_error_of_equal_rotations_is_zero_although_rounding_may_exceed_one() -> None:
    quats = random_quats(0, 1000)
    errors = rotation_error_rad(quats, quats)
    assert np.isfinite(errors).all()
    assert errors.max() < 1e-7


@given(seeds)
def test_six_numbers_hold_the_first_two_columns(seed: int) -> None:
    quats = random_quats(seed, 4)
    six = rotation_6d(quats)
    first, second = six[:, :3], six[:, 3:]
    np.testing.assert_allclose((first * second).sum(axis=-1), 0, atol=1e-12)
    matrix = np.stack([first, second, np.cross(first, second)], axis=-1)
    np.testing.assert_allclose(matrix, quat_to_matrix(quats), atol=1e-12)


@given(seeds)
def test_a_motion_takes_a_bodys_points_from_one_pose_to_the_other(seed: int) -> None:
    start, end = random_poses(seed, 5), random_poses(seed + 1, 5)
    points = generator(seed, "points").normal(size=(5, 7, 3))
    motion = motion_between(start, end)
    offsets = transform_points(start, points) - start[:, None, :3]
    moved = rotate(motion[:, None, 3:], offsets) + start[:, None, :3] + motion[:, None, :3]
    np.testing.assert_allclose(moved, transform_points(end, points), atol=1e-12)
    at_rest = motion_between(start, start)
    np.testing.assert_allclose(at_rest, np.tile([0, 0, 0, 1, 0, 0, 0], (5, 1)), atol=1e-12)


@given(seeds)
def test_one_set_of_points_is_placed_at_many_poses(seed: int) -> None:
    poses = random_poses(seed, 6)
    points = generator(seed, "points").normal(size=(9, 3))
    placed = transform_points(poses, points)
    assert placed.shape == (6, 9, 3)
    expected = np.stack([scipy_rotation(row[3:]).apply(points) + row[:3] for row in poses])
    np.testing.assert_allclose(placed, expected, atol=1e-12)


@given(seeds, st.integers(min_value=1, max_value=40))
def test_a_rows_result_does_not_depend_on_its_batch(seed: int, size: int) -> None:
    poses, others = random_poses(seed, size), random_poses(seed + 1, size)
    quats, other_quats = poses[:, 3:], others[:, 3:]
    for function, arguments in (
        (quat_multiply, (quats, other_quats)),
        (rotation_error_rad, (quats, other_quats)),
        (rotate, (quats, others[:, :3])),
        (motion_between, (poses, others)),
        (rotation_6d, (quats,)),
        (quat_normalize, (2 * quats,)),
        (quat_from_matrix, (quat_to_matrix(quats),)),
    ):
        whole = function(*arguments)
        alone = np.stack([function(*(argument[i] for argument in arguments)) for i in range(size)])
        np.testing.assert_array_equal(whole, alone, err_msg=function.__name__)


@given(seeds)
def test_a_pose_and_its_row_are_the_same_to_the_bit(seed: int) -> None:
    row = random_poses(seed)
    pose = Pose.from_row(row)
    np.testing.assert_array_equal(pose.as_row(), row)
    assert Pose.from_row(pose.as_row()) == pose


def test_unit_quaternions_are_told_from_others() -> None:
    np.testing.assert_array_equal(is_unit(np.array([[1.0, 0, 0, 0], [1.0, 0.1, 0, 0], [0.0, 0, 0, 0]])), [1, 0, 0])
    assert is_unit(random_quats(0, 100)).all()
    assert not is_unit(np.array([1.0, 1.0, 0.0, 0.0]))


@pytest.mark.parametrize(("precision", "tolerance"), [("float64", 1e-12), ("float32", 1e-6)])
def test_torch_tensors_give_what_arrays_give(precision: str, tolerance: float) -> None:
    torch = pytest.importorskip("torch")
    poses, others = random_poses(0, 30), random_poses(1, 30)
    points = generator(0, "points").normal(size=(30, 5, 3))
    for function, arguments in (
        (quat_multiply, (poses[:, 3:], others[:, 3:])),
        (quat_conjugate, (poses[:, 3:],)),
        (quat_normalize, (2 * poses[:, 3:],)),
        (quat_to_matrix, (poses[:, 3:],)),
        (quat_from_matrix, (quat_to_matrix(poses[:, 3:]),)),
        (rotate, (poses[:, 3:], others[:, :3])),
        (transform_points, (poses, points)),
        (rotation_error_rad, (poses[:, 3:], others[:, 3:])),
        (rotation_6d, (poses[:, 3:],)),
        (motion_between, (poses, others)),
    ):
        made = function(*(torch.as_tensor(argument, dtype=getattr(torch, precision)) for argument in arguments))
        assert isinstance(made, torch.Tensor)
        np.testing.assert_allclose(made, function(*arguments), atol=tolerance, err_msg=function.__name__)
