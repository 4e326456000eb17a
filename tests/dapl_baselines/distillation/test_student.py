import numpy as np
import torch

from clutter6d.seeding import generator
from dapl_baselines.distillation.settings import DistillationSettings
from dapl_baselines.distillation.student import Student
from dapl_baselines.distillation.windows import take_windows
from dapl_baselines.replay import Replay
from tests.dapl_baselines.distillation.small_distillation import SETTINGS, make_encoder

ENVS, EPISODE_STEPS, EPISODES = 32, 8, 12


def make_settings(history: int) -> DistillationSettings:
    network = SETTINGS.network.model_copy(update={"history": history, "encoder": make_encoder().config})
    return SETTINGS.model_copy(update={"network": network, "learning_rate": 2e-3})


def fill(replay: Replay, size: int) -> None:
    """Episodes in which a number that stays the same is the action, and what is seen of it is off by as much."""
    rng = generator(0, "hidden")
    for _ in range(EPISODES):
        hidden = 0.5 * rng.standard_normal((ENVS, 1)).astype(np.float32)
        for age in range(EPISODE_STEPS):
            state = np.zeros((ENVS, size), dtype=np.float32)
            state[:, :1] = hidden + 0.5 * rng.standard_normal((ENVS, 1))
            replay.add(
                {
                    "state": torch.from_numpy(state),
                    "stored": torch.zeros(ENVS, 40, 16).half(),
                    "age": torch.full((ENVS,), age).int(),
                    "action": torch.from_numpy(hidden).expand(-1, 7).clamp(-1, 1),
                }
            )


def loss_of(folder, history: int) -> float:
    """Mean action loss on episodes that were not learned from."""
    settings = make_settings(history)
    student, size = Student(settings, make_encoder()), settings.network.state_size
    like = {"state": torch.zeros(1, size), "stored": torch.zeros(1, 40, 16).half(), "age": torch.zeros(1).int()}
    replay = Replay(folder, like | {"action": torch.zeros(1, 7)}, EPISODES * EPISODE_STEPS * ENVS)
    fill(replay, size)
    student.update_statistics(replay.take(np.arange(replay.count), ["state"])["state"])
    rng, learned = generator(0, "batches"), replay.count * 3 // 4
    for numbers in rng.integers(learned, size=(250, 64)):
        student.learn(take_windows(replay, numbers, envs=ENVS, history=history))
    held_out = take_windows(replay, np.arange(learned, replay.count), envs=ENVS, history=history)
    wrong = student.act(held_out) / 0.1 - held_out["action"]
    return float(wrong.square().mean())


def test_what_only_time_tells_is_learned_with_a_history_alone(tmp_path):
    """The best guess from one look has half of the variance left; from six looks, a seventh."""
    without, with_history = (loss_of(tmp_path / str(history), history) for history in (1, 6))
    assert with_history < 0.6 * without
