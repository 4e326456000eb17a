"""Recorded episodes, simulated again to be looked at."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.eval.builtin_policies import ZeroPolicy
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.motion import replay_motions
from clutter6d.sim.robot import HOME_QPOS
from tests.scene_fixtures import BoxSceneSet, make_box_scene_set


def evaluate(tmp_path, scenes):
    evaluation = Evaluation(scenes, ZeroPolicy(), tmp_path, EvaluationConfig(pairs=1, max_steps=3))
    for part in ("journal", "floor"):
        list(evaluation.run(part, num_envs=2, threads=1))
    evaluation.finish()


def test_a_motion_begins_at_the_pair_and_ends_where_the_table_says(tmp_path):
    scenes = make_box_scene_set(2)
    evaluate(tmp_path, scenes)
    motions = list(replay_motions(tmp_path, scenes))
    assert [motion.row.key for motion in motions] == [("boxes-0", 0), ("boxes-1", 0)]
    for motion in motions:
        assert motion.qpos.shape == (motion.row.steps + 1, 7 + 7 * 4)
        assert np.array_equal(motion.qpos[0, :7], HOME_QPOS)
        pair = motion.scene.goal_pairs[0]
        assert np.array_equal(motion.qpos[0, 7:].reshape(4, 7), pair.object_poses)
        error = np.linalg.norm(motion.qpos[-1, 7:10] - pair.goal.position)
        assert error == motion.row.position_error_m


def test_motions_need_the_scenes_of_the_evaluation(tmp_path):
    scenes = make_box_scene_set(2)
    evaluate(tmp_path, scenes)
    other = BoxSceneSet(scenes=scenes.scenes, assets=scenes.assets, sha256="c" * 64)
    with pytest.raises(InvalidValueError, match="other scenes"):
        list(replay_motions(tmp_path, other))
