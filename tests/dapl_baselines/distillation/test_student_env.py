import numpy as np
import torch

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.noise import DISTILLATION_NOISE
from clutter6d.envs.termination import TerminationConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from dapl_baselines.distillation.student_env import StudentEnv
from dapl_baselines.policy.observation import cloud
from tests.dapl_baselines.distillation.small_distillation import SETTINGS, TowardsTheGoal
from tests.scene_fixtures import make_box_scene_set


def plain_env(noise) -> ClutterVectorEnv:
    config = EnvConfig(noise=noise, termination=TerminationConfig(max_steps=SETTINGS.max_steps))
    return ClutterVectorEnv(4, split=make_box_scene_set(3), config=config, autoreset_mode="SameStep", threads=1)


def make_env(teacher: TowardsTheGoal) -> StudentEnv:
    env = StudentEnv(make_box_scene_set(3), SETTINGS, teacher, threads=1)
    env.reset(seed=5)
    return env


def test_only_the_student_sees_errors_and_they_are_the_environments_own():
    env, clean, noisy = make_env(TowardsTheGoal()), plain_env(EnvConfig().noise), plain_env(DISTILLATION_NOISE)
    true, wrong = clean.reset(seed=5)[0], noisy.reset(seed=5)[0]
    residuals = np.full((4, 7), 0.02, dtype=np.float32)
    for _ in range(SETTINGS.max_steps + 2):
        seen = env.teacher_input().observation
        assert all(np.array_equal(seen[name], true[name]) for name in true)
        assert torch.equal(env.student_view().cloud, cloud(wrong))
        env.step(torch.from_numpy(residuals))
        true, wrong = clean.step(residuals)[0], noisy.step(residuals)[0]
    errors = cloud(wrong) - cloud(true)
    assert torch.allclose(errors[:, :1024, [0, 1, 2, 4, 5, 6]].std(), torch.tensor(0.05), rtol=0.05)
    assert not errors[:, 1024:].any()


def test_the_teacher_hears_of_every_episode_and_of_the_steps_made():
    teacher = TowardsTheGoal()
    env = make_env(teacher)
    for step in range(SETTINGS.max_steps):
        assert env.teacher_input().steps.tolist() == [step] * 4
        env.step(torch.zeros(4, 7))
    assert teacher.begun == [0, 1, 2, 3] * 2
    assert env.teacher_input().steps.tolist() == [0] * 4
    assert env.tally.take().episodes == 4


def test_it_goes_on_elsewhere_with_the_same_errors():
    env, other = make_env(TowardsTheGoal()), make_env(TowardsTheGoal())
    for _ in range(3):
        env.step(torch.full((4, 7), 0.05))
    other.restore(env.snapshot())
    for one in (env, other):
        one.step(torch.full((4, 7), -0.05))
    assert torch.equal(env.student_view().cloud, other.student_view().cloud)
    assert torch.equal(env.student_view().state, other.student_view().state)
