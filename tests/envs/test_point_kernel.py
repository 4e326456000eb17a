"""The compiled point clouds against the readable ones: equal to the bit, whatever the slots hold."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.envs.point_cloud import (
    PointClouds,
    RigidMotion,
    SceneClouds,
    free_body_motion,
    motion_in_world,
    nearest_points,
    point_clouds,
)
from clutter6d.envs.point_kernel import compiled, compiled_nearest_points, compiled_point_clouds
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_normalize
from clutter6d.seeding import generator

Case = tuple[SceneClouds, RigidMotion, RigidMotion]


def make_case(seed: int, slots: int = 3, objects: int = 4, grid_m: float | None = None) -> Case:
    """Random clouds and motions; on a grid, without rotation, many distances are equal."""
    rng = generator(seed, "clouds")
    clouds = SceneClouds.allocate(slots, objects)
    clouds.points[:] = rng.normal(scale=0.04, size=clouds.points.shape)
    clouds.point_mass[:] = rng.uniform(1e-4, 1e-2, size=clouds.point_mass.shape)
    clouds.target_centroid[:] = clouds.points[:, 0].mean(axis=-1, keepdims=True)
    poses = rng.normal(scale=0.2, size=(slots, objects, 7))
    poses[..., 3:] = quat_normalize(rng.normal(size=(slots, objects, 4)))
    velocities = rng.normal(size=(slots, objects, 6))
    if grid_m is not None:
        clouds.points[:] = np.round(clouds.points / grid_m) * grid_m
        clouds.target_centroid[:] = 0
        poses[:] = [0, 0, 0, 1, 0, 0, 0]
    hands = motion_in_world(poses[:, 0], velocities[:, 0, :3], velocities[:, 0, 3:])
    return clouds, free_body_motion(poses, velocities), hands


def assert_same_bits(made: PointClouds, expected: PointClouds) -> None:
    for name in ("target", "environment", "hand"):
        assert getattr(made, name).tobytes() == np.ascontiguousarray(getattr(expected, name)).tobytes(), name


@given(seed=st.integers(0, 10_000), objects=st.integers(2, 12))
def test_compiled_clouds_are_the_readable_ones_to_the_bit(seed, objects):
    case = make_case(seed, objects=objects)
    assert_same_bits(compiled_point_clouds(*case), point_clouds(*case))


@given(seed=st.integers(0, 10_000), grid_m=st.sampled_from([0.02, 0.05, 0.2]))
def test_of_points_that_are_equally_near_both_take_the_first(seed, grid_m):
    case = make_case(seed, grid_m=grid_m)
    assert_same_bits(compiled_point_clouds(*case), point_clouds(*case))


def test_when_all_points_are_equally_near_the_first_obstacle_is_taken():
    clouds, objects, hands = make_case(0)
    clouds.points[:] = 0
    clouds.point_mass[:] = [[1, 2, 3, 4]]
    still = RigidMotion(
        rotation=objects.rotation,
        position=np.zeros_like(objects.position),
        linear_velocity=objects.linear_velocity,
        angular_velocity=objects.angular_velocity,
    )
    made = compiled_point_clouds(clouds, still, hands)
    assert (made.environment[..., 3] == 2).all()
    assert_same_bits(made, point_clouds(clouds, still, hands))


def test_slots_may_be_filled_in_parts_and_in_any_order():
    case = make_case(1, slots=7)

    def backwards(rows, fill):
        for row in reversed(range(rows)):
            fill(slice(row, row + 1))

    assert_same_bits(compiled_point_clouds(*case, each_part=backwards), compiled_point_clouds(*case))


def test_poses_that_are_no_numbers_still_give_full_clouds():
    clouds, objects, hands = make_case(2)
    objects.position[0, 2] = np.nan
    made = compiled_point_clouds(clouds, objects, hands)
    assert np.isfinite(made.environment[1:]).all()
    assert np.isfinite(made.environment[0, :, :3]).all()


def test_a_target_without_obstacles_is_refused():
    with pytest.raises(InvalidValueError, match="at least one obstacle"):
        SceneClouds.allocate(1, 1)


def test_code_that_can_be_kept_nowhere_is_still_compiled():
    """As on a read-only installation without a home directory; here: a function that is in no file."""
    scope: dict = {}
    exec("def double(value):\n    return 2 * value", scope)
    assert compiled(scope["double"])(3) == 6


@given(seed=st.integers(0, 10_000), grid_m=st.sampled_from([None, 0.05]))
def test_compiled_and_readable_choice_of_environment_points_are_the_same(seed, grid_m):
    clouds, objects, _ = make_case(seed, grid_m=grid_m)
    np.testing.assert_array_equal(compiled_nearest_points(clouds, objects), nearest_points(clouds, objects))
