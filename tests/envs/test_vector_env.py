import logging

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.action_scale import ActionScaleCurriculum
from clutter6d.envs.cameras import DEFAULT_CAMERAS
from clutter6d.envs.clutter_env import ClutterEnv
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.noise import NoiseConfig
from clutter6d.envs.randomisation import MODEST_RANDOMISATION, RandomisationConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.seeding import generator
from tests.scene_fixtures import make_box_scene_set

SCENES = make_box_scene_set(5)
SHAPES = {
    "object_points": (512, 7),
    "environment_points": (512, 7),
    "end_effector_points": (256, 7),
    "hand_state": (9,),
    "joint_state": (14,),
    "relative_goal": (9,),
    "physics_parameters": (5,),
    "previous_action": (7,),
}
SHORT = EnvConfig(termination=TerminationConfig(max_steps=3))


def actions(size: int, step: int) -> np.ndarray:
    return generator(0, "actions", step).uniform(-0.1, 0.1, size=(size, 7)).astype(np.float32)


def still(size: int) -> np.ndarray:
    return np.zeros((size, 7), dtype=np.float32)


def test_spaces_are_the_papers_table():
    env = ClutterVectorEnv(3, split=SCENES)
    assert {name: space.shape for name, space in env.single_observation_space.spaces.items()} == SHAPES
    assert env.single_action_space.shape == (7,)
    assert env.action_space.shape == (3, 7)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_it_behaves_to_the_bit_as_gymnasiums_own_vector_of_single_environments(mode):
    ours = ClutterVectorEnv(3, split=SCENES, config=SHORT, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: ClutterEnv(split=SCENES, config=SHORT)] * 3, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] is mode
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    # The second environment begins a step earlier than the others, so that they do not end together.
    only_second = {"reset_mask": np.array([False, True, False])}
    ours.step(actions(3, 0))
    theirs.step(actions(3, 0))
    assert_same(ours.reset(options=dict(only_second)), theirs.reset(options=dict(only_second)))
    for step in range(1, 9):
        ours_step, theirs_step = ours.step(actions(3, step)), theirs.step(actions(3, step))
        assert_same(ours_step, theirs_step)
        over = ours_step[2] | ours_step[3]
        if mode is AutoresetMode.DISABLED and over.any():
            assert_same(ours.reset(options={"reset_mask": over}), theirs.reset(options={"reset_mask": over.copy()}))


def assert_same(ours: tuple, theirs: tuple) -> None:
    for mine, other in zip(ours, theirs, strict=True):
        assert data_equivalence(mine, other, exact=True), (mine, other)


def test_episodes_do_not_depend_on_the_other_environments_or_on_threads():
    many, one = ClutterVectorEnv(6, split=SCENES, threads=2), ClutterVectorEnv(1, split=SCENES, threads=1)
    first, alone = many.reset(seed=10), one.reset(seed=13)
    for step in range(3):
        for name, value in alone[0].items():
            assert np.array_equal(value[0], first[0][name][3]), name
        chosen = actions(6, step)
        first, alone = many.step(chosen), one.step(chosen[3:4])


def test_a_seed_names_the_whole_stream_of_episodes():
    env = ClutterVectorEnv(2, split=SCENES)
    first = [env.reset(seed=4)[1], *[env.reset()[1] for _ in range(3)]]
    again = [env.reset(seed=4)[1], *[env.reset()[1] for _ in range(3)]]
    assert data_equivalence(first, again)
    names = {(info["scene_id"][0], int(info["pair"][0])) for info in first}
    assert len(names) > 1


def test_scene_and_pair_can_be_chosen_for_all_or_for_each():
    env = ClutterVectorEnv(2, split=SCENES)
    _, info = env.reset(options={"scene_id": "boxes-3", "pair": [0, 1]})
    assert info["scene_id"].tolist() == ["boxes-3", "boxes-3"]
    assert info["pair"].tolist() == [0, 1]


def test_reward_is_the_sum_of_the_terms_in_info():
    env = ClutterVectorEnv(4, split=SCENES)
    env.reset(seed=0)
    for step in range(5):
        _, rewards, _, _, info = env.step(actions(4, step))
        assert np.array_equal(
            rewards, sum(info["reward_terms"][name] for name in ("proximity", "coarse", "fine", "success"))
        )
        assert (rewards > 0).all()


def test_a_target_at_its_goal_ends_the_episode_with_success():
    env = ClutterVectorEnv(2, split=SCENES)
    env.reset(seed=0)
    core = env._episodes.core
    core.batch.object_poses[1, 0] = core.goals[1]
    _, rewards, terminated, truncated, info = env.step(still(2))
    assert terminated.tolist() == [False, True]
    assert not truncated.any()
    assert info["outcome"].tolist() == [None, "success"]
    assert info["is_success"].tolist() == [False, True]
    assert rewards[1] > 1000
    assert info["position_error_m"][1] < 0.05


def test_an_object_that_falls_off_the_table_ends_the_episode():
    env = ClutterVectorEnv(1, split=SCENES)
    env.reset(seed=0)
    env._episodes.core.batch.object_poses[0, 2, :3] = (0.0, 1.5, -0.2)
    _, _, terminated, _, info = env.step(still(1))
    assert terminated[0]
    assert info["outcome"][0] == "drop"


def test_the_action_scale_can_be_lowered_while_training():
    env = ClutterVectorEnv(1, split=SCENES)
    asked = np.full((1, 7), 0.1, dtype=np.float32)
    moved = []
    for scale in (0.1, 0.01):
        env.action_scale_rad = scale
        env.reset(options={"scene_id": "boxes-0", "pair": 0})
        before = env._episodes.core.batch.arm_qpos[0].copy()
        env.step(asked)
        moved.append(np.abs(env._episodes.core.batch.joint_targets[0] - before).max())
    assert moved[0] > 5 * moved[1]
    np.testing.assert_allclose(moved[1], 0.01)
    with pytest.raises(InvalidValueError, match="action scale"):
        env.action_scale_rad = 0.0


def test_a_curriculum_lowers_the_action_scale_step_by_step():
    curriculum = ActionScaleCurriculum(steps=4)
    env = ClutterVectorEnv(1, split=SCENES, config=EnvConfig(action=ActionConfig(curriculum=curriculum)))
    env.reset(seed=0)
    scales = []
    for _ in range(6):
        env.step(still(1))
        scales.append(env.action_scale_rad)
    np.testing.assert_allclose(scales, [0.1, 0.0562341, 0.0316228, 0.0177828, 0.01, 0.01], rtol=1e-5)
    env.training_step = 2
    env.step(still(1))
    assert env.action_scale_rad == pytest.approx(0.0316228, rel=1e-5)


def test_an_action_may_be_a_movement_of_the_hand():
    env = ClutterVectorEnv(2, split=SCENES, config=EnvConfig(action=ActionConfig(control="cartesian")))
    assert env.single_action_space.shape == (6,)
    before, _ = env.reset(seed=0)
    for _ in range(10):
        after, *_ = env.step(np.tile(np.array([0.02, 0, -0.01, 0, 0, 0], dtype=np.float32), (2, 1)))
    moved = after["hand_state"] - before["hand_state"]
    assert (moved[:, 0] > 0.1).all()
    assert (moved[:, 2] < -0.02).all()  # the arm lags behind its targets
    assert np.abs(moved[:, 1]).max() < 0.01
    assert np.abs(moved[:, 3:]).max() < 0.2  # and the wrist lags less than the shoulder
    assert after["previous_action"].shape == (2, 7)
    assert after["previous_action"].any()


def test_options_change_what_is_seen_and_simulated():
    config = EnvConfig(
        noise=NoiseConfig(velocity=0.25, coordinates_m=0.01),
        randomisation=RandomisationConfig(table_height_m=(0.05, 0.05), latency_s=(0.05, 0.05)),
        mass_scale={"large_0": 100.0},
        has_object_states=True,
    )
    plain, varied = ClutterVectorEnv(1, split=SCENES), ClutterVectorEnv(1, split=SCENES, config=config)
    names = {"scene_id": "boxes-1", "pair": 1}
    first, changed = plain.reset(seed=0, options=dict(names))[0], varied.reset(seed=0, options=dict(names))[0]
    assert changed in varied.observation_space
    states = changed["object_states"][0]
    np.testing.assert_allclose(states[:, 13], [0.3, 30.0, 0.3, 0.3], rtol=1e-6)
    raised = changed["object_points"][0, :, :3].mean(axis=0) - first["object_points"][0, :, :3].mean(axis=0)
    np.testing.assert_allclose(raised, [0, 0, 0.05], atol=0.003)
    np.testing.assert_allclose(changed["relative_goal"], first["relative_goal"], atol=1e-6)
    for _ in range(5):
        after, _, terminated, *_ = varied.step(still(1))
        assert not terminated.any()
    np.testing.assert_allclose(after["object_states"][0, :, :7], states[:, :7], atol=1e-3)


def test_what_an_episode_draws_follows_its_seed_and_not_the_other_environments():
    config = EnvConfig(noise=NoiseConfig(mass=0.5, goal_pose=0.1), randomisation=MODEST_RANDOMISATION)
    many, one = (ClutterVectorEnv(size, split=SCENES, config=config) for size in (3, 1))
    together, alone = many.reset(seed=3)[0], one.reset(seed=5)[0]
    for step in range(3):
        for name, value in alone.items():
            assert np.array_equal(value[0], together[name][2]), name
        chosen = actions(3, step)
        together, alone = many.step(chosen)[0], one.step(chosen[2:])[0]
    next_episode = one.reset()[0]
    assert not np.array_equal(next_episode["physics_parameters"], alone["physics_parameters"])


def test_cameras_are_part_of_the_observation():
    config = EnvConfig(cameras=(DEFAULT_CAMERAS[0],))
    env = ClutterVectorEnv(2, split=SCENES, config=config, max_episode_steps=2, autoreset_mode="SameStep")
    observations, _ = env.reset(seed=0)
    assert observations in env.observation_space
    assert observations["camera_front_rgb"].shape == (2, 96, 128, 3)
    labels = set(np.unique(observations["camera_front_segmentation"]))
    assert {1, 2, 3, 4} <= labels
    env.step(still(2))
    observations, *_, info = env.step(still(2))
    assert info["final_obs"][0]["camera_front_depth"].shape == (96, 128)
    assert observations in env.observation_space
    env.close()


def test_an_object_that_no_scene_has_cannot_be_made_heavy():
    env = ClutterVectorEnv(1, split=SCENES, config=EnvConfig(mass_scale={"large_1": 100.0}))
    with pytest.raises(UnknownNameError, match="did you mean 'large_0'"):
        env.reset(seed=0)


def test_frames_show_each_environment():
    env = ClutterVectorEnv(2, split=SCENES, render_mode="rgb_array")
    env.reset(options={"scene_id": ["boxes-0", "boxes-4"], "pair": 0})
    frames = env.render()
    assert [frame.shape for frame in frames] == [(480, 640, 3)] * 2
    assert (frames[0] != frames[1]).any()
    env.close()


def test_the_registered_ids_make_vectors_over_the_frozen_splits():
    env = gymnasium.make_vec("Clutter6D-Moderate-v1", num_envs=2, max_episode_steps=2, autoreset_mode="SameStep")
    assert isinstance(env, ClutterVectorEnv)
    _, info = env.reset(seed=0)
    assert all(name.startswith("moderate-") for name in info["scene_id"])
    env.step(still(2))
    _, _, _, truncated, info = env.step(still(2))
    assert truncated.all()
    assert info["final_info"]["outcome"].tolist() == ["timeout"] * 2


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: ClutterVectorEnv(0, split=SCENES), InvalidValueError, "num_envs is 0"),
        (lambda: ClutterVectorEnv(split=SCENES, track="dense"), InvalidValueError, "of the track sparse, not dense"),
        (lambda: ClutterVectorEnv(split="sparse-trian"), UnknownNameError, "did you mean 'sparse-train'"),
        (lambda: ClutterVectorEnv(split=SCENES, render_mode="human"), UnknownNameError, "rgb_array"),
        (lambda: ClutterVectorEnv(split=SCENES, autoreset_mode="next"), UnknownNameError, "NextStep"),
        (lambda: ClutterVectorEnv(split=SCENES, max_episode_steps=0), InvalidValueError, "at least 1 step"),
        (lambda: ClutterVectorEnv(split=SCENES, kept_models=0), InvalidValueError, "kept models is 0"),
    ],
)
def test_arguments_that_make_no_environment_are_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"scene": "boxes-0"}, UnknownNameError, "did you mean 'scene_id'"),
        ({"scene_id": "boxes-0"}, InvalidValueError, "together"),
        ({"scene_id": "boxes-9", "pair": 0}, UnknownNameError, "boxes-9"),
        ({"scene_id": "boxes-0", "pair": 2}, InvalidValueError, "goal pairs 0 to 1, not 2"),
        ({"scene_id": "boxes-0", "pair": 0.5}, InvalidValueError, "give one value"),
        ({"scene_id": "boxes-0", "pair": [0, 0.5]}, InvalidValueError, "not a whole number"),
        ({"scene_id": ["boxes-0"] * 3, "pair": 0}, InvalidValueError, "3 values for 2 environments"),
        ({"reset_mask": [True, True]}, InvalidValueError, "boolean array of 2 entries"),
        ({"reset_mask": np.array([False, False])}, InvalidValueError, "not all false"),
        ({"reset_mask": np.array([True, False])}, InvalidValueError, "first reset"),
    ],
)
def test_reset_options_that_mean_nothing_are_refused(options, error, message):
    env = ClutterVectorEnv(2, split=SCENES)
    with pytest.raises(error, match=message):
        env.reset(seed=0, options=options)


def test_steps_that_cannot_be_made_are_refused():
    env = ClutterVectorEnv(2, split=SCENES, config=SHORT, autoreset_mode=AutoresetMode.DISABLED)
    with pytest.raises(ResetNeeded):
        env.step(still(2))
    with pytest.raises(InvalidValueError, match="3 seeds for 2"):
        env.reset(seed=[1, 2, 3])
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match=r"shape \(3, 7\), expected \(2, 7\)"):
        env.step(still(3))
    with pytest.raises(InvalidValueError, match=r"environments \[1\] are not finite"):
        env.step(np.array([[0.0] * 7, [np.nan] * 7], dtype=np.float32))
    for _ in range(3):
        env.step(still(2))
    with pytest.raises(InvalidValueError, match=r"environments \[0, 1\] are over"):
        env.step(still(2))


def test_a_step_logs_nothing(caplog):
    with caplog.at_level(logging.INFO):
        env = ClutterVectorEnv(2, split=SCENES)
        env.reset(seed=0)
        env.step(actions(2, 0))
    assert not caplog.records


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_restored_snapshot_goes_on_to_the_bit(mode):
    config = EnvConfig(
        action=ActionConfig(curriculum=ActionScaleCurriculum(steps=20)),
        termination=TerminationConfig(max_steps=4),
        noise=NoiseConfig(mass=0.1, velocity=0.1, coordinates_m=0.01),
        randomisation=MODEST_RANDOMISATION,
    )
    unbroken = ClutterVectorEnv(3, split=SCENES, config=config, autoreset_mode=mode)
    unbroken.reset(seed=5)
    only_second = {"reset_mask": np.array([False, True, False])}
    for step in range(2):
        unbroken.step(actions(3, step))
        unbroken.reset(options=dict(only_second))
    for step in range(2, 4):
        observation = unbroken.step(actions(3, step))[0]
    snapshot = unbroken.snapshot()
    resumed = ClutterVectorEnv(3, split=SCENES, config=config, autoreset_mode=mode)
    assert data_equivalence(resumed.restore(snapshot), observation)
    for step in range(4, 13):
        if mode is AutoresetMode.DISABLED and (over := unbroken._is_over.copy()).any():
            assert_same(
                unbroken.reset(options={"reset_mask": over}), resumed.reset(options={"reset_mask": over.copy()})
            )
        assert_same(unbroken.step(actions(3, step)), resumed.step(actions(3, step)))


def test_a_snapshot_is_of_an_environment_that_has_begun_and_of_as_many():
    env = ClutterVectorEnv(2, split=SCENES)
    with pytest.raises(ResetNeeded):
        env.snapshot()
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match="2 seeds for 3 environments"):
        ClutterVectorEnv(3, split=SCENES).restore(env.snapshot())
