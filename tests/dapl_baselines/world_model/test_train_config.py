"""Settings of a training: how the learning rate goes, and what is refused."""

import pytest
from pydantic import ValidationError

from clutter6d.errors import UnknownNameError
from dapl_baselines.world_model.train_config import TRAIN_PRESETS, TrainConfig, find_train_preset


def test_the_learning_rate_rises_and_falls_to_zero():
    config = TrainConfig(steps=1000, learning_rate=1.0, warmup_steps=50)
    rates = [config.learning_rate_at(step, 0.0) for step in range(1000)]
    assert rates[0] == pytest.approx(1 / 50)
    assert max(rates) == pytest.approx(1.0, abs=0.01)
    assert rates[500] == pytest.approx(0.5, abs=0.01)
    assert rates[-1] < 1e-5


def test_whichever_limit_is_nearer_counts():
    config = TrainConfig(steps=1000, minutes=1.0)
    assert config.progress(100, 30.0) == 0.5
    assert config.progress(900, 30.0) == 0.9
    assert config.progress(100, 90.0) == 1.0


def test_a_short_training_is_warm_after_a_tenth():
    config = TrainConfig(steps=100, warmup_steps=500, schedule="constant", learning_rate=1.0)
    assert config.learning_rate_at(9, 0.0) == config.learning_rate_at(99, 0.0) == 1.0


def test_rows_of_curves_must_be_whole_when_the_state_is_saved():
    with pytest.raises(ValidationError, match="multiple"):
        TrainConfig(log_every=10, save_every=25)


def test_presets_are_found_by_name():
    assert find_train_preset("paper").train.steps == 500_000
    assert set(TRAIN_PRESETS) == {"laptop", "paper"}
    with pytest.raises(UnknownNameError, match="did you mean 'laptop'"):
        find_train_preset("laptops")
