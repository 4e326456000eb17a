import numpy as np
import pytest

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.observation import OBSERVATION_SHAPES
from clutter6d.envs.slots import ClutterSlots
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from clutter6d.sim.scene_model import SceneModel
from dapl_baselines.planners.hand_servo import servo_residuals
from dapl_baselines.state_estimation.pose_observer import NEUTRAL_FRICTION, PoseObserver
from dapl_baselines.state_estimation.pose_only_policy import EstimatorConfig, estimate_poses
from tests.dapl_baselines.state_estimation.tracks import differences
from tests.scene_fixtures import make_box_scene

ONLY = np.arange(1)
FINGERS_DOWN = np.diag([1.0, -1, -1])[None]


def make_observer(model: SceneModel) -> PoseObserver:
    return PoseObserver(np.stack([asset.surface_points for asset in model.assets]), model.object_masses_kg())


class Push:
    """A simulated robot that lowers its hand behind the target, pushes it through an obstacle's place, and stops."""

    def __init__(self) -> None:
        scene, self.model = make_box_scene()
        self.env = ClutterSlots([self.model], EnvConfig(action=ActionConfig()), threads=1)
        self.goal = scene.goal_pairs[0].goal
        self.env.load(ONLY, [self.model], [scene.goal_pairs[0]])
        self._start = self.env.batch.object_poses[0, 0, :3].copy()

    def steps(self):
        """Let it act; yields after every control step, and at the start."""
        yield self.env
        behind, beyond = self._start + [-0.01, -0.12, 0.0], self._start + [0.02, 0.16, 0.0]
        for point, steps, speed in ((behind, 25, 0.05), (beyond, 22, 0.015), (beyond, 8, 0.0)):
            for _ in range(steps):
                arm = self.env.batch.arm_qpos.copy()
                residuals = servo_residuals(arm, point[None], FINGERS_DOWN, np.array([speed]))
                self.env.step(ONLY, residuals.astype(np.float32))
                yield self.env


def look(env: ClutterSlots, poses: np.ndarray) -> tuple[np.ndarray, ...]:
    return poses, env.batch.arm_qpos[0].copy(), env.batch.arm_qvel[0].copy(), env.previous_actions[0].copy()


def test_exact_poses_give_the_environments_observation_but_for_velocities_and_privileged_numbers():
    push = Push()
    observer = make_observer(push.model)
    observer.start(push.goal)
    for env in push.steps():
        ours, truth = observer.observe(*look(env, env.batch.object_poses[0].copy())), env.observe()
        assert {name: value.shape for name, value in ours.items()} == OBSERVATION_SHAPES
        assert all(value.dtype == np.float32 for value in ours.values())
        for name in ("hand_state", "joint_state", "previous_action", "end_effector_points"):
            assert np.array_equal(ours[name], truth[name][0])
    # The hand has stopped, so the filter, which smooths, believes what it sees.
    np.testing.assert_allclose(ours["object_points"][:, :4], truth["object_points"][0, :, :4], atol=1e-3)
    np.testing.assert_allclose(ours["relative_goal"], truth["relative_goal"][0], atol=1e-2)


def test_point_velocities_of_a_pushed_object_are_nearer_the_truth_than_those_of_differences():
    push, rng, config = Push(), generator(0, "estimator"), EstimatorConfig(missed_share=0.1)
    observer, ours, truth, seen = make_observer(push.model), [], [], []
    observer.start(push.goal)
    for step, env in enumerate(push.steps()):
        poses = estimate_poses(env.batch.object_poses[0], config, rng, is_first=step == 0)
        ours.append(observer.observe(*look(env, poses))["object_points"][:, 4:])
        truth.append(env.observe()["object_points"][0, :, 4:])
        last = poses if not seen else np.where(np.isnan(poses), seen[-1], poses)
        seen.append(last)
    velocities = differences(np.stack(seen), 0.1)[:, 0]
    points = push.model.assets[0].surface_points
    turned = np.stack(
        [point_velocities(pose[0], velocity, points) for pose, velocity in zip(seen, velocities, strict=True)]
    )
    truth_rms, filter_rms, difference_rms = (
        float(np.sqrt((error**2).sum(axis=-1).mean()))
        for error in (np.stack(truth), np.stack(ours) - np.stack(truth), turned - np.stack(truth))
    )
    assert truth_rms > 0.03, "the push must move the target"
    assert filter_rms < 0.6 * difference_rms


def point_velocities(pose: np.ndarray, velocity: np.ndarray, points: np.ndarray) -> np.ndarray:
    rotation = quat_to_matrix(pose[3:])
    return np.cross(velocity[3:], points) @ rotation.T + velocity[:3]


def test_the_privileged_numbers_are_what_a_robot_can_assume():
    _, model = make_box_scene()
    observer, push = make_observer(model), Push()
    observer.start(push.goal)
    seen = observer.observe(*look(push.env, push.env.batch.object_poses[0].copy()))["physics_parameters"]
    np.testing.assert_allclose(seen[:2], [0.3, NEUTRAL_FRICTION], rtol=1e-6)


def test_every_object_must_be_seen_once_and_each_episode_anew():
    push = Push()
    observer, poses = make_observer(push.model), push.env.batch.object_poses[0].copy()
    hidden = poses.copy()
    hidden[2] = np.nan
    observer.start(push.goal)
    with pytest.raises(InvalidValueError, match=r"objects \[2\] have not been seen"):
        observer.observe(*look(push.env, hidden))
    observer.observe(*look(push.env, poses))
    for _ in range(10):
        observer.observe(*look(push.env, hidden))
    observer.start(push.goal)
    with pytest.raises(InvalidValueError, match="have not been seen"):
        observer.observe(*look(push.env, hidden))


@pytest.mark.parametrize("masses", [[0.3, 0.3], [0.3, 0.3, 0.0, 0.3], [0.3, 0.3, np.nan, 0.3]])
def test_each_object_needs_a_mass(masses):
    _, model = make_box_scene()
    with pytest.raises(InvalidValueError, match="give a positive one for each of 4 objects"):
        PoseObserver(np.stack([asset.surface_points for asset in model.assets]), np.array(masses))
