import numpy as np
import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.distillation.windows import take_windows
from dapl_baselines.replay import Replay

ENVS, STEPS, KEPT = 3, 40, 30


@pytest.mark.parametrize("history", [1, 2, 5])
@pytest.mark.parametrize("steps", [1, 4, STEPS])
def test_a_window_is_the_last_rows_of_its_environment_in_its_episode(tmp_path, history, steps):
    """Against a list for each environment, with episodes that end at random, and after the ring has gone round."""
    rng, ages, count = generator(0, "episodes"), np.zeros(ENVS, dtype=np.int32), 0
    episodes: list[list[float]] = [[] for _ in range(ENVS)]
    expected: list[list[float]] = []
    like = {"state": torch.zeros(ENVS, 1), "stored": torch.zeros(ENVS, 2).half(), "age": torch.zeros(ENVS).int()}
    replay = Replay(tmp_path, like | {"action": torch.zeros(ENVS, 1)}, KEPT + (history - 1) * ENVS)
    for _ in range(steps):
        values = torch.arange(count, count + ENVS, dtype=torch.float32)[:, None]
        seen = {"state": values, "stored": values.repeat(1, 2).half(), "age": torch.from_numpy(ages.copy())}
        replay.add(seen | {"action": -values})
        for env in range(ENVS):
            episodes[env].append(float(count + env))
            expected.append(episodes[env][-history:])
            if rng.random() < 0.3:
                episodes[env].clear()
        ages, count = np.array([len(episode) for episode in episodes], dtype=np.int32), count + ENVS
    numbers = rng.permutation(np.arange(max(0, count - KEPT), count))
    windows = take_windows(replay, numbers, envs=ENVS, history=history)
    assert windows["state"].shape == (len(numbers), history, 1)
    assert torch.equal(windows["state"].repeat(1, 1, 2).half(), windows["stored"])
    assert windows["action"][:, 0].tolist() == (-numbers).tolist()
    for row, number in enumerate(numbers.tolist()):
        assert windows["state"][row, windows["is_seen"][row], 0].tolist() == expected[number]
        assert windows["is_seen"][row].tolist() == sorted(windows["is_seen"][row].tolist())
