"""Somebody who looks at the window and presses keys: hands, eyes and contact, but for the wall's clock."""

from dataclasses import replace

import numpy as np

from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.geometry import Pose, quat_to_matrix
from clutter6d.sim.robot import hand_pose
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from dapl_baselines.teleop.keyboard import KeyboardDevice
from dapl_baselines.teleop.pace import Pace
from dapl_baselines.teleop.policy import TeleopPolicy
from tests.dapl_baselines.teleop.people import Window
from tests.scene_fixtures import make_box_scene_set

WAY = [(-0.05, -0.2, 0.3), (-0.05, -0.2, 0.045), (-0.05, 0.2, 0.045)]
"""Above a place beside the target, down to the table, through the target."""
CLOSE_M = 0.012
KEYS = (("i", "k"), ("j", "l"), ("u", "o"))


class Looker(Window):
    """Steers the finger tips along the way by what the window shows, turning the hand as it goes over."""

    is_closed = False

    def __init__(self) -> None:
        super().__init__()
        self.way = [np.array(point) for point in WAY]
        self.tips, self.presses = np.zeros(3), 0

    def update(self, qpos) -> None:
        pose = hand_pose(qpos[None, :7])[0]
        self.tips = pose[:3] + TIP_OFFSET_M * quat_to_matrix(pose[3:])[:, 2]

    def keys(self) -> tuple[str, ...]:
        self.presses += 1
        if self.presses == 1:
            return ("enter",)
        while len(self.way) > 1 and np.abs(self.way[0] - self.tips).max() < CLOSE_M:
            self.way.pop(0)
        left = self.way[0] - self.tips
        speed = "2" if self.presses < 28 or np.abs(left).max() > 0.03 else "1"
        turn = ("r",) if self.presses < 28 else ()
        return (speed, *turn, *(KEYS[axis][int(left[axis] > 0)] for axis in range(3) if abs(left[axis]) > 0.006))


def near_goal(scenes):
    """The same scenes with the first goal 7 cm from the start."""
    scene = scenes.scenes[0]
    first, second = scene.goal_pairs
    goal = Pose(position=(-0.05, -0.03, 0.07), quat_wxyz=first.goal.quat_wxyz)
    return replace(scenes, scenes=(replace(scene, goal_pairs=(replace(first, goal=goal), second)),))


def test_somebody_with_a_keyboard_pushes_the_target_to_its_goal(tmp_path):
    person, now = Looker(), [0.0]

    def a_moment_later(status) -> None:
        now[0] += 0.2

    policy = TeleopPolicy(
        KeyboardDevice(lambda: now[0]),
        tmp_path,
        keys=person,
        view=person,
        show=a_moment_later,
        pace=Pace(lambda: 0.0, lambda seconds: None),
    )
    evaluation = Evaluation(near_goal(make_box_scene_set(1)), policy, tmp_path, EvaluationConfig(pairs=1))
    (row,) = evaluation.run(num_envs=1, threads=1)
    assert (row.outcome, row.holds) == ("success", True)
    assert 25 < row.steps < 90
