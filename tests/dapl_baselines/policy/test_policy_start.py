"""Trainings that begin with a trained policy."""

import json
from contextlib import closing

import pytest
import torch

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, InvalidValueError
from dapl_baselines.checkpoint import TrainingRecord, read_checkpoint, write_checkpoint
from dapl_baselines.cli import PROGRAM
from dapl_baselines.encoders.dapl import DaplEncoder
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.policy_start import PolicyStart, history_before, open_start
from dapl_baselines.policy.ppo import assemble
from dapl_baselines.world_model.model import WorldModel
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, STATE_ONLY, make_network
from tests.dapl_baselines.policy.small_training import SETTINGS, make_training
from tests.dapl_baselines.world_model.tiny import TINY_MODEL
from tests.scene_fixtures import write_box_scene_set

CONFIG = STATE_ONLY.model_copy(update={"encoder": SMALL_ENCODER, "action_scale_rad": 0.03})
START = PolicyStart(network=make_network(CONFIG, seed=5))
ONE_ITERATION = SETTINGS.model_copy(update={"iterations": 1})


def record(method: str, steps: int = 1) -> TrainingRecord:
    return TrainingRecord(method=method, steps=steps, unit="steps", seed=0)


def test_it_begins_with_all_weights_but_the_encoders(tmp_path):
    training = make_training(tmp_path / "run", start=START)
    network = assemble(training.settings.network, training._runner.alg, training._source.module)
    for name, tensor in network.state_dict().items():
        mine = training._source.module.state_dict()[name[8:]] if name.startswith("encoder.") else None
        assert torch.equal(tensor, START.network.state_dict()[name] if mine is None else mine), name


def test_it_goes_on_at_the_action_scale_at_which_the_policy_ended(tmp_path):
    training = make_training(tmp_path / "run", start=START)
    assert training.settings.network.action_scale_rad == 0.03
    assert training._env.envs.config.action.action_scale_rad == 0.03


def test_stopped_and_continued_the_weights_are_those_of_the_state(tmp_path):
    with closing(make_training(tmp_path / "run", start=START).run()) as reports:
        next(reports)
    first, again = (make_training(tmp_path / "run", start=START)._runner.alg.actor.head[0].weight for _ in range(2))
    assert torch.equal(first, again)
    assert not torch.equal(first, START.network.actor[0].weight)


def test_run_json_and_history_name_the_start(tmp_path):
    path = tmp_path / "start.pt"
    write_checkpoint(path, architecture="policy-network", config=CONFIG, module=START.network, history=(record("ppo"),))
    list(make_training(tmp_path / "run", ONE_ITERATION, start=open_start(path)).run())
    assert json.loads((tmp_path / "run" / "run.json").read_text())["start_sha256"] == START.sha256
    history = read_checkpoint(tmp_path / "run" / "policy.pt").header.history
    assert [(each.method, each.steps) for each in history] == [("ppo", 1), ("ppo", 16)]
    with pytest.raises(InvalidValueError, match=r"start_sha256 was \w+, is \)"):
        make_training(tmp_path / "run", ONE_ITERATION.model_copy(update={"network": CONFIG}))


def test_what_policy_and_encoder_have_in_common_is_told_once():
    first, policy, second = record("world-model"), record("ppo"), record("world-model", 2)
    encoder = EncoderSource(config=SMALL_ENCODER, module=DaplEncoder(SMALL_ENCODER), history=(first, second))
    start = PolicyStart(network=START.network, history=(first, policy))
    assert history_before(encoder, start) == (first, policy, second)
    assert history_before(None, None) == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"fusion_sizes": (8,)}, r"fusion_sizes is \(32, 16\), and \(8,\) in the policy to begin with"),
        ({"state_parts": ("relative_goal",)}, "state_parts is"),
        ({"encoder": None}, "size of tokens is 16, and None"),
    ],
)
def test_a_policy_of_another_kind_is_refused(tmp_path, change, said):
    network = make_network(CONFIG.model_copy(update=change))
    with pytest.raises(InvalidValueError, match=said):
        make_training(tmp_path / "run", start=PolicyStart(network=network))
    assert not (tmp_path / "run").exists()


def test_the_command_begins_with_a_policy(tmp_path, capsys):
    write_box_scene_set(tmp_path / "scenes", 2)
    config = STATE_ONLY.model_copy(update={"fusion_sizes": (512, 256, 128), "head_sizes": (64,)})
    path = tmp_path / "start.pt"
    write_checkpoint(path, architecture="policy-network", config=config, module=make_network(config))
    where = ["--split", str(tmp_path / "scenes"), "--out", str(tmp_path / "run"), "--threads", "1", "--envs", "1"]
    command = ["train", "policy", *where, "--start", str(path), "--max-minutes", "0", "--iterations", "2"]
    assert run(command, PROGRAM) == 0
    assert len(json.loads((tmp_path / "run" / "run.json").read_text())["start_sha256"]) == 64
    assert run([*command, "--no-physics", "--out", str(tmp_path / "other")], PROGRAM) == 2
    assert "state_parts is" in capsys.readouterr().err


def test_a_world_model_is_no_policy_to_begin_with(tmp_path):
    path = tmp_path / "world-model.pt"
    write_checkpoint(path, architecture="world-model", config=TINY_MODEL, module=WorldModel(TINY_MODEL))
    with pytest.raises(InvalidFileError, match="holds a world-model, expected a policy network"):
        open_start(path)
