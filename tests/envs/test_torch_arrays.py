"""The same functions on torch tensors: equal to NumPy's results in float64 to 1e-12 and in float32 to 1e-6."""

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

from clutter6d.envs.action import ActionConfig, joint_targets
from clutter6d.envs.control_mode import cartesian_residuals
from clutter6d.envs.observation import BodyState, TaskArrays, make_observation
from clutter6d.envs.reward import RewardConfig, compute_reward, finger_tips
from clutter6d.envs.termination import TerminationConfig, goal_errors, is_at_goal, is_dropped
from clutter6d.geometry import quat_normalize
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_kinematics
from clutter6d.sim.robot import HOME_QPOS
from tests.scene_fixtures import make_box_scene

torch = pytest.importorskip("torch")

SLOTS, OBJECTS = 6, 4
ANGLE_TOLERANCE = {torch.float64: 1e-7, torch.float32: 1e-3}
"""Near 1, the arc cosine turns a rounding error into its square root."""
PRECISIONS = pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float64, 1e-12), (torch.float32, 1e-6)])


def to_torch(value: Any, dtype: Any) -> Any:
    """Arrays, and dataclasses of arrays, as tensors; what is float64 becomes ``dtype``."""
    if is_dataclass(value):
        return type(value)(**{field.name: to_torch(getattr(value, field.name), dtype) for field in fields(value)})
    tensor = torch.as_tensor(np.array(value))
    return tensor.to(dtype) if tensor.dtype == torch.float64 else tensor


def assert_close(made: Any, expected: np.ndarray, tolerance: float) -> None:
    assert isinstance(made, torch.Tensor)
    np.testing.assert_allclose(made.numpy(), expected, atol=tolerance, rtol=tolerance)


@pytest.fixture(scope="module")
def state() -> BodyState:
    rng = generator(0, "state")
    poses = rng.normal(scale=0.1, size=(SLOTS, OBJECTS, 7))
    poses[..., 3:] = quat_normalize(rng.normal(size=(SLOTS, OBJECTS, 4)))
    return BodyState(
        arm_qpos=HOME_QPOS + rng.normal(scale=0.2, size=(SLOTS, 7)),
        arm_qvel=rng.normal(scale=0.1, size=(SLOTS, 7)),
        object_poses=poses,
        object_velocities=rng.normal(scale=0.1, size=(SLOTS, OBJECTS, 6)),
    )


@pytest.fixture(scope="module")
def task() -> TaskArrays:
    made = TaskArrays.allocate(SLOTS, OBJECTS)
    for slot in range(SLOTS):
        scene, model = make_box_scene(slot)
        made.load(slot, model, scene.goal_pairs[1].goal)
    return made


@pytest.fixture(scope="module")
def actions() -> np.ndarray:
    return generator(0, "actions").uniform(-0.1, 0.1, size=(SLOTS, 7)).astype(np.float32)


@PRECISIONS
def test_observation(state, task, actions, dtype, tolerance):
    expected = make_observation(state, task, actions)
    made = make_observation(to_torch(state, dtype), to_torch(task, dtype), torch.as_tensor(actions))
    assert made.keys() == expected.keys()
    for name, value in made.items():
        assert value.dtype == torch.float32
        assert_close(value, expected[name], tolerance)


@PRECISIONS
def test_reward(state, task, dtype, tolerance):
    """Slots at the goal and far from it, fingers near the target and far from it."""
    goals, starts = task.goals.copy(), state.object_poses + [0.01, 0, 0, 0, 0, 0, 0]
    goals[::2] = state.object_poses[::2, 0]
    tips = finger_tips(hand_kinematics(state.arm_qpos).pose)
    tips[::3] = state.object_poses[::3, :1, :3] + 0.02
    expected = compute_reward(state.object_poses, starts, goals, tips, RewardConfig())
    assert (expected.success > 0).any()
    made = compute_reward(
        *(to_torch(each, dtype) for each in (state.object_poses, starts, goals, tips)), RewardConfig()
    )
    for name in ("proximity", "coarse", "fine", "success", "total"):
        assert getattr(made, name).dtype == dtype
        allowed = tolerance if name == "proximity" else ANGLE_TOLERANCE[dtype]
        assert_close(getattr(made, name), getattr(expected, name), allowed)


@PRECISIONS
def test_termination(state, task, dtype, tolerance):
    config, poses, goals = TerminationConfig(), state.object_poses, task.goals.copy()
    goals[::2] = poses[::2, 0]
    expected, made = goal_errors(poses[:, 0], goals), goal_errors(to_torch(poses, dtype)[:, 0], to_torch(goals, dtype))
    assert_close(made.position_m, expected.position_m, tolerance)
    assert_close(made.planar_m, expected.planar_m, tolerance)
    assert_close(made.rotation_rad, expected.rotation_rad, ANGLE_TOLERANCE[dtype])
    at_goal = is_at_goal(made.position_m, made.rotation_rad, config)
    assert at_goal.tolist() == is_at_goal(expected.position_m, expected.rotation_rad, config).tolist()
    assert is_dropped(to_torch(poses, dtype), config).tolist() == is_dropped(poses, config).tolist()


@PRECISIONS
def test_actions(state, actions, dtype, tolerance):
    """Residuals are rounded to float32 in between, where the last bit of a sine may decide."""
    tolerance = max(tolerance, 1e-8)
    arms, config = state.arm_qpos, ActionConfig(max_hand_step_m=0.02)
    expected = joint_targets(actions, arms, config)
    assert_close(joint_targets(torch.as_tensor(actions), to_torch(arms, dtype), config), expected, tolerance)
    deltas = generator(0, "deltas").normal(scale=0.01, size=(SLOTS, 6))
    made = cartesian_residuals(to_torch(deltas, dtype), to_torch(arms, dtype), config)
    assert made.dtype == torch.float32
    assert_close(made, cartesian_residuals(deltas, arms, config), tolerance)
