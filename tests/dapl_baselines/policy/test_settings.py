import pytest
from pydantic import ValidationError

from dapl_baselines.policy.settings import PRESETS, TrainingSettings


def test_the_paper_preset_is_the_papers_table():
    paper = PRESETS["paper"]
    assert paper.ppo.model_dump() == {
        "value_loss_coef": 0.5,
        "use_clipped_value_loss": True,
        "clip_param": 0.3,
        "entropy_coef": 0.006,
        "num_learning_epochs": 8,
        "num_mini_batches": 8,
        "learning_rate": 5e-5,
        "schedule": "adaptive",
        "gamma": 0.99,
        "lam": 0.95,
        "desired_kl": 0.016,
        "max_grad_norm": 1.0,
    }
    assert paper.envs == 2048
    assert (paper.network.fusion_sizes, paper.network.head_sizes, paper.network.query_tokens) == (
        (512, 256, 128),
        (64,),
        1,
    )


def test_the_papers_action_scale_falls_from_a_tenth_to_a_hundredth():
    curriculum = PRESETS["paper"].env().action.curriculum
    assert (curriculum.at(0), curriculum.at(20_000 * 24)) == (0.1, 0.01)
    assert PRESETS["laptop"].env().action.curriculum is None


def test_a_teacher_without_points_asks_the_environment_for_the_true_states():
    network = PRESETS["laptop"].network
    teacher = network.model_copy(update={"state_parts": (*network.state_parts, "object_states"), "objects": 4})
    assert PRESETS["laptop"].model_copy(update={"network": teacher}).env().has_object_states
    assert not PRESETS["laptop"].env().has_object_states


def test_ppo_has_no_use_for_a_memory():
    with pytest.raises(ValidationError, match="PPO trains policies without a memory"):
        TrainingSettings.model_validate({"network": {"history": 2}})
