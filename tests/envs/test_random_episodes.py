"""A thousand episodes of each track with random actions, and some that touch more: the physics stays sound."""

from collections.abc import Callable

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.scene import TABLE_SIZE_M
from clutter6d.seeding import generator

EPISODES = {"residuals": 1000, "sweeps": 300}
ENVS = 100
HAND_ABOVE_TIPS_M = 0.11
RECOVERY_STEPS = 1
"""A phone that is slapped flat is in the table by more than half its 10 mm for 20 ms: contacts are springs."""
Actions = Callable[[int, dict[str, np.ndarray]], np.ndarray]


def random_residuals(env: ClutterVectorEnv) -> Actions:
    """Joint residuals, even within the action space; one episode in fifty moves an object."""
    rng = generator(0, "random residuals")
    return lambda _, __: rng.uniform(-1, 1, size=env.action_space.shape) * env.single_action_space.high


def random_sweeps(env: ClutterVectorEnv) -> Actions:
    """The hand sweeps from one random place among the objects to the next, as fast as it is let."""
    rng, goals = generator(0, "random sweeps"), np.zeros((env.num_envs, 3))

    def act(step: int, observations: dict[str, np.ndarray]) -> np.ndarray:
        if step % 8 == 0:
            goals[:] = rng.uniform((-0.2, -0.4, HAND_ABOVE_TIPS_M), (0.25, 0.4, 0.25), size=goals.shape)
        way = goals - observations["hand_state"][:, :3]
        turn = rng.uniform(-0.1, 0.1, size=goals.shape)
        return np.concatenate([way, turn], axis=1)

    return act


MANNERS = {"residuals": ("joint", random_residuals), "sweeps": ("cartesian", random_sweeps)}


@pytest.mark.slow
@pytest.mark.parametrize("manner", MANNERS)
@pytest.mark.parametrize("track", ["sparse", "moderate", "dense"])
def test_many_random_episodes_stay_sound(track, manner, tmp_path):
    touched = run_random_episodes(
        track, manner, episodes=EPISODES[manner], envs=ENVS, max_steps=300, unstable_dir=tmp_path
    )
    assert touched > {"residuals": 0.005, "sweeps": 0.5}[manner]


@pytest.mark.parametrize("manner", MANNERS)
@pytest.mark.parametrize("track", ["sparse", "moderate", "dense"])
def test_a_few_short_random_episodes_stay_sound(track, manner, tmp_path):
    run_random_episodes(track, manner, episodes=16, envs=8, max_steps=30, unstable_dir=tmp_path)


def run_random_episodes(track: str, manner: str, *, episodes: int, envs: int, max_steps: int, unstable_dir) -> float:
    """Returns the share of the episodes in which an object was moved by a centimetre."""
    control, make_actions = MANNERS[manner]
    env = ClutterVectorEnv(
        envs,
        split=f"{track}-test",
        config=EnvConfig(action=ActionConfig(control=control)),
        autoreset_mode=AutoresetMode.SAME_STEP,
        max_episode_steps=max_steps,
        unstable_dir=unstable_dir,
    )
    act, core = make_actions(env), env._episodes.core
    observations, _ = env.reset(seed=0)
    steps_below = np.zeros(core.batch.object_poses.shape[:2], dtype=int)
    step, touched, is_touched, outcomes = 0, 0, np.zeros(envs, dtype=bool), []
    while len(outcomes) < episodes:
        actions = act(step, observations).astype(np.float32)
        observations, rewards, terminated, truncated, info = env.step(actions)
        assert np.isfinite(rewards).all()
        assert all(np.isfinite(value).all() for value in observations.values())
        over = terminated | truncated
        below = in_or_under_the_table(core.batch.object_poses)
        steps_below = np.where(below & ~over[:, None], steps_below + 1, 0)
        sunk = (steps_below > RECOVERY_STEPS).any(axis=1)
        assert not sunk.any(), (info["scene_id"][sunk], info["pair"][sunk], step)
        if over.any():
            outcomes += list(info["final_info"]["outcome"][over])
            touched += int(is_touched[over].sum())
            is_touched[over] = False
        is_touched |= (np.abs(core.batch.object_poses - core.start_poses)[..., :3] > 0.01).any(axis=(1, 2))
        step += 1
    assert set(outcomes) <= {"success", "drop", "timeout"}
    assert not list(unstable_dir.iterdir())
    return touched / len(outcomes)


def in_or_under_the_table(poses: np.ndarray) -> np.ndarray:
    """Which objects' centres are below the table's top and within its edges."""
    x, y, z = (poses[..., axis] for axis in range(3))
    return (z < 0) & (np.abs(x) < TABLE_SIZE_M[0] / 2) & (np.abs(y) < TABLE_SIZE_M[1] / 2)
