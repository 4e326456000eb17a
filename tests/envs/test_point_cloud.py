import numpy as np
import pytest

from clutter6d.envs.point_cloud import (
    SceneClouds,
    follow_points,
    free_body_motion,
    motion_in_world,
    nearest_points,
    point_clouds,
)
from clutter6d.geometry import quat_from_axis_angle, quat_multiply, rotate, transform_points
from clutter6d.seeding import generator
from tests.scene_fixtures import make_box_scene

SLOTS, OBJECTS = 5, 4


@pytest.fixture
def clouds() -> SceneClouds:
    made = SceneClouds.allocate(SLOTS, OBJECTS)
    for slot in range(SLOTS):
        made.load(slot, make_box_scene(slot)[1])
    return made


def random_motion(seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = generator(seed, "motion")
    poses = rng.normal(scale=0.2, size=(SLOTS, OBJECTS, 7))
    poses[..., 3:] = rng.normal(size=(SLOTS, OBJECTS, 4))
    poses[..., 3:] /= np.linalg.norm(poses[..., 3:], axis=-1, keepdims=True)
    return poses, rng.normal(size=(SLOTS, OBJECTS, 6))


def features(clouds: SceneClouds, poses: np.ndarray, velocities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    hands = motion_in_world(poses[:, 0], velocities[:, 0, :3], velocities[:, 0, 3:])
    made = point_clouds(clouds, free_body_motion(poses, velocities), hands)
    return made.target, made.environment


def test_target_points_are_the_canonical_points_at_the_targets_pose(clouds):
    poses, velocities = random_motion()
    target, _ = features(clouds, poses, velocities)
    for slot in range(SLOTS):
        canonical = make_box_scene(slot)[1].assets[0].surface_points.astype(np.float64)
        np.testing.assert_allclose(target[slot, :, :3], transform_points(poses[slot, 0], canonical), atol=1e-6)


def test_each_point_carries_its_share_of_the_mass(clouds):
    target, environment = features(clouds, *random_motion())
    np.testing.assert_allclose(target[..., 3].sum(axis=1), 0.3, rtol=1e-5)
    np.testing.assert_allclose(environment[..., 3], 0.3 / 512, rtol=1e-6)


def test_velocities_are_those_of_the_rigid_body(clouds):
    """MuJoCo: linear velocity in the world frame, angular velocity in the body's own."""
    poses, velocities = random_motion()
    target, _ = features(clouds, poses, velocities)
    step = 1e-5
    moved = poses.copy()
    moved[..., :3] += step * velocities[..., :3]
    angle = np.linalg.norm(velocities[..., 3:], axis=-1)
    turn = quat_from_axis_angle(velocities[..., 3:] / angle[..., None], angle * step)
    moved[..., 3:] = quat_multiply(poses[..., 3:], turn)
    for slot in range(SLOTS):
        points = make_box_scene(slot)[1].assets[0].surface_points.astype(np.float64)
        difference = transform_points(moved[slot, 0], points) - transform_points(poses[slot, 0], points)
        np.testing.assert_allclose(target[slot, :, 4:], difference / step, atol=1e-3)


def test_environment_points_are_the_nearest_of_all_obstacles(clouds):
    poses, velocities = random_motion()
    _, environment = features(clouds, poses, velocities)
    for slot in range(SLOTS):
        assets = make_box_scene(slot)[1].assets
        everything = np.concatenate(
            [transform_points(poses[slot, k], assets[k].surface_points.astype(float)) for k in range(1, OBJECTS)]
        )
        centroid = transform_points(poses[slot, 0], assets[0].surface_points.astype(float)).mean(axis=0)
        distances = np.sort(np.linalg.norm(everything - centroid, axis=1))
        found = np.linalg.norm(environment[slot, :, :3] - centroid, axis=1)
        np.testing.assert_allclose(np.sort(found), distances[:512], atol=1e-5)


def test_environment_points_keep_the_velocity_of_their_own_obstacle(clouds):
    poses, velocities = random_motion()
    velocities[..., 3:] = 0
    _, environment = features(clouds, poses, velocities)
    for slot in range(SLOTS):
        linear = velocities[slot, 1:, :3].astype(np.float32)
        nearest = np.abs(environment[slot, :, None, 4:] - linear).max(axis=-1).min(axis=-1)
        assert nearest.max() < 1e-6


def test_points_at_equal_distance_are_chosen_by_their_order(clouds):
    """Three obstacles in the same place tie point by point; the first one's are taken, in order."""
    for slot in range(SLOTS):
        clouds.points[slot, 1:] = clouds.points[slot, 1]
    poses, velocities = random_motion()
    poses[:, 1:] = poses[:, 1:2]
    _, environment = features(clouds, poses, velocities)
    chosen = environment[0, :, :3]
    assert len(np.unique(chosen, axis=0)) <= 171 + 1


def test_a_slots_points_do_not_depend_on_the_other_slots(clouds):
    poses, velocities = random_motion()
    together = features(clouds, poses, velocities)
    for slot in range(SLOTS):
        alone = features(clouds[slot : slot + 1], poses[slot : slot + 1], velocities[slot : slot + 1])
        assert np.array_equal(together[0][slot], alone[0][0])
        assert np.array_equal(together[1][slot], alone[1][0])


def test_angular_velocity_is_turned_into_the_world_frame():
    pose = np.array([[0.0, 0, 0, np.sqrt(0.5), np.sqrt(0.5), 0, 0]])
    velocity = np.array([[0.0, 0, 0, 0, 0, 2.0]])
    motion = free_body_motion(pose, velocity)
    np.testing.assert_allclose(motion.angular_velocity[0], rotate(pose[0, 3:], np.array([0, 0, 2.0])), atol=1e-6)


def test_chosen_points_are_followed_into_a_later_state(clouds):
    """The environment's points of one state, at another: each is the same point of the same obstacle."""
    before, after = random_motion(0), random_motion(1)
    hands = [motion_in_world(poses[:, 0], vel[:, 0, :3], vel[:, 0, 3:]) for poses, vel in (before, after)]
    chosen = nearest_points(clouds, free_body_motion(*before))
    followed = follow_points(clouds, free_body_motion(*after), hands[1], chosen)
    for slot in range(SLOTS):
        body, point = 1 + chosen[slot] // 512, chosen[slot] % 512
        for row in (0, 100, 511):
            canonical = clouds.points[slot, body[row], :, point[row]].astype(np.float64)
            expected = transform_points(after[0][slot, body[row]], canonical[None])[0]
            np.testing.assert_allclose(followed.environment[slot, row, :3], expected, atol=1e-6)
    same = follow_points(clouds, free_body_motion(*before), hands[0], chosen)
    whole = point_clouds(clouds, free_body_motion(*before), hands[0])
    assert same.environment.tobytes() == whole.environment.tobytes()
