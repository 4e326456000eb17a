import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from clutter6d.geometry import quat_from_axis_angle, quat_multiply, quat_to_matrix
from dapl_baselines.state_estimation.rotation_vectors import (
    cross_matrix,
    quat_from_rotation_vector,
    right_jacobian,
    rotation_vector_from_quat,
)

within_a_ball = arrays(np.float64, (5, 3), elements=st.floats(-1.7, 1.7))


@given(within_a_ball)
def test_logarithm_undoes_exponential_within_half_a_turn(vectors):
    np.testing.assert_allclose(rotation_vector_from_quat(quat_from_rotation_vector(vectors)), vectors, atol=1e-12)


@given(within_a_ball)
def test_both_signs_of_a_quaternion_are_the_same_rotation(vectors):
    quats = quat_from_rotation_vector(vectors)
    np.testing.assert_allclose(rotation_vector_from_quat(-quats), rotation_vector_from_quat(quats), atol=1e-12)


@given(within_a_ball, st.sampled_from([1e-12, 1e-6, 1e-4, 1e-3, 1.0]))
def test_the_right_jacobian_is_the_derivative_of_the_exponential(vectors, scale):
    vectors, d = scale * vectors, 1e-6
    there = quat_from_rotation_vector(-vectors)
    columns = [
        rotation_vector_from_quat(quat_multiply(there, quat_from_rotation_vector(vectors + d * axis))) / d
        for axis in np.eye(3)
    ]
    np.testing.assert_allclose(right_jacobian(vectors), np.stack(columns, axis=-1), atol=5e-6)


def test_exponential_is_the_turn_about_an_axis():
    axis = np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(quat_from_rotation_vector(2.5 * axis), quat_from_axis_angle(axis, 2.5), atol=1e-15)
    assert np.array_equal(quat_from_rotation_vector(np.zeros(3)), [1, 0, 0, 0])
    assert np.array_equal(rotation_vector_from_quat(np.array([1.0, 0, 0, 0])), np.zeros(3))


def test_the_cross_matrix_takes_the_vector_product():
    a, b = np.array([1.0, 2, 3]), np.array([-2.0, 0.5, 4])
    np.testing.assert_allclose(cross_matrix(a) @ b, np.cross(a, b))
    np.testing.assert_allclose(
        quat_to_matrix(quat_from_rotation_vector(1e-6 * a)), np.eye(3) + 1e-6 * cross_matrix(a), atol=1e-10
    )
