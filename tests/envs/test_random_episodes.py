"""A thousand episodes of each track with random actions: the physics stays sound."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.scene import TABLE_SIZE_M
from clutter6d.seeding import generator

EPISODES = 1000
ENVS = 100


@pytest.mark.slow
@pytest.mark.parametrize("track", ["sparse", "moderate", "dense"])
def test_a_thousand_random_episodes_stay_sound(track, tmp_path):
    run_random_episodes(track, episodes=EPISODES, envs=ENVS, max_steps=300, unstable_dir=tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("track", ["sparse", "moderate", "dense"])
def test_a_few_short_random_episodes_stay_sound(track, tmp_path):
    run_random_episodes(track, episodes=16, envs=8, max_steps=30, unstable_dir=tmp_path)
    assert not list(tmp_path.iterdir())


def run_random_episodes(track: str, *, episodes: int, envs: int, max_steps: int, unstable_dir) -> None:
    env = ClutterVectorEnv(
        envs,
        split=f"{track}-test",
        autoreset_mode=AutoresetMode.SAME_STEP,
        max_episode_steps=max_steps,
        unstable_dir=unstable_dir,
    )
    env.reset(seed=0)
    poses = env._episodes.core.batch.object_poses
    rng, ended = generator(0, "random episodes", track), 0
    while ended < episodes:
        actions = (env.single_action_space.high * rng.uniform(-1, 1, size=env.action_space.shape)).astype(np.float32)
        observations, rewards, terminated, truncated, info = env.step(actions)
        assert np.isfinite(rewards).all()
        assert all(np.isfinite(value).all() for value in observations.values())
        assert not in_or_under_the_table(poses).any(), info["scene_id"][in_or_under_the_table(poses).any(axis=1)]
        if (terminated | truncated).any():
            outcomes = info["final_info"]["outcome"][terminated | truncated]
            assert set(outcomes) <= {"success", "drop", "timeout"}
            ended += len(outcomes)


def in_or_under_the_table(poses: np.ndarray) -> np.ndarray:
    """Which objects' centres are below the table's top and within its edges."""
    x, y, z = (poses[..., axis] for axis in range(3))
    return (z < 0) & (np.abs(x) < TABLE_SIZE_M[0] / 2) & (np.abs(y) < TABLE_SIZE_M[1] / 2)
