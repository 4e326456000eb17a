import numpy as np
import pytest

from clutter6d.envs.termination import TerminationConfig, find_outcome, goal_errors, is_at_goal, is_dropped
from clutter6d.errors import InvalidValueError
from clutter6d.geometry import quat_from_yaw

CONFIG = TerminationConfig()
GOAL = np.array([[0.1, 0.2, 0.05, 1, 0, 0, 0]])


def shifted(x: float = 0, y: float = 0, z: float = 0, yaw: float = 0.0) -> np.ndarray:
    return np.array([[*(GOAL[0, :3] + [x, y, z]), *quat_from_yaw(yaw)]])


@pytest.mark.parametrize(
    ("pose", "is_success", "is_planar"),
    [
        (shifted(), True, True),
        (shifted(x=0.0499), True, True),
        (shifted(x=0.0501), False, False),
        (shifted(z=0.06), False, True),
        (shifted(x=0.03, y=0.03, z=0.03), False, True),
        (shifted(yaw=0.099), True, True),
        (shifted(yaw=-0.101), False, False),
        (shifted(yaw=2 * np.pi), True, True),
    ],
)
def test_success_is_judged_in_three_dimensions_and_by_the_angle(pose, is_success, is_planar):
    errors = goal_errors(pose, GOAL)
    assert is_at_goal(errors.position_m, errors.rotation_rad, CONFIG)[0] == is_success
    assert is_at_goal(errors.planar_m, errors.rotation_rad, CONFIG)[0] == is_planar


def test_the_sign_of_a_quaternion_does_not_matter():
    pose = shifted()
    pose[:, 3:] *= -1
    assert goal_errors(pose, GOAL).rotation_rad[0] == 0


@pytest.mark.parametrize(("height", "is_drop"), [(0.1, False), (-0.0499, False), (-0.0501, True)])
def test_any_objects_centre_five_centimetres_below_the_table_top_is_a_drop(height, is_drop):
    poses = np.zeros((1, 3, 7)) + [0, 0, 0.1, 1, 0, 0, 0]
    poses[0, 2, 2] = height
    assert is_dropped(poses, CONFIG)[0] == is_drop


def test_the_first_reason_to_end_wins():
    yes, no = np.array([True]), np.array([False])

    def outcome(success, drop, unstable, step):
        return find_outcome(
            is_success=success, dropped=drop, is_unstable=unstable, steps=np.array([step]), config=CONFIG
        )[0]

    assert outcome(no, no, no, 299) is None
    assert outcome(no, no, no, 300) == "timeout"
    assert outcome(yes, no, no, 300) == "success"
    assert outcome(yes, yes, no, 7) == "success"
    assert outcome(no, yes, no, 7) == "drop"
    assert outcome(yes, yes, yes, 7) == "unstable"


def test_an_episode_has_at_least_one_step():
    with pytest.raises(InvalidValueError):
        TerminationConfig(max_steps=0)
