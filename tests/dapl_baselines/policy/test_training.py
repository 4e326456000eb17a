import json
from contextlib import closing
from itertools import islice
from pathlib import Path

import pytest
import torch

from clutter6d.errors import InvalidFileError, InvalidValueError
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.policy.rollout_env import RolloutEnv
from dapl_baselines.policy.training import ARCHITECTURE
from tests.dapl_baselines.interrupted import curve, kill_after, outcome
from tests.dapl_baselines.policy.small_training import SETTINGS, make_training


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken") / "run"
    assert [report.iteration for report in make_training(folder).run()] == list(range(1, 11))
    return folder


def test_it_leaves_curves_and_checkpoints(unbroken):
    training, validation = curve(unbroken / "training.csv"), curve(unbroken / "validation.csv")
    assert [int(row["iteration"]) for row in validation] == [4, 8, 10]
    assert [int(row["environment_steps"]) for row in training] == [16 * number for number in range(1, 11)]
    assert sum(int(row["episodes"]) for row in training) == 4 * (40 // 6)
    scales = [float(row["action_scale_rad"]) for row in training]
    assert scales == sorted(scales, reverse=True)
    assert scales[-1] == 0.01
    assert len({row["learning_rate"] for row in training}) > 1
    assert (unbroken / "tensorboard").is_dir()


def test_the_checkpoint_says_how_the_policy_came_about(unbroken):
    checkpoint = read_checkpoint(unbroken / "policy.pt")
    record = checkpoint.header.history[-1]
    assert (checkpoint.header.architecture, record.method, record.steps) == (ARCHITECTURE, "ppo", 160)
    assert len(record.split_sha256) == len(record.code_sha256) == 64
    assert record.settings["ppo"]["clip_param"] == 0.3
    assert checkpoint.module.config.action_scale_rad == 0.01
    assert checkpoint.module.trunk.statistics.count == 160


def test_the_encoder_does_not_change_and_has_the_scale_of_what_it_sees(unbroken):
    encoder = read_checkpoint(unbroken / "policy.pt").module.encoder
    assert encoder.tokenizer.statistics.count > 0
    first = make_training(unbroken)._source.module
    for name, tensor in first.state_dict().items():
        assert torch.equal(encoder.state_dict()[name], tensor), name


def test_stopped_and_continued_it_is_the_unbroken_run(unbroken, tmp_path):
    for made in (3, 2, 5):
        with closing(make_training(tmp_path / "run").run()) as reports:
            assert len(list(islice(reports, made))) == made
    assert outcome(tmp_path / "run") == outcome(unbroken)
    assert list(make_training(tmp_path / "run").run()) == []


def test_episodes_that_begin_anew_as_on_a_gpu_keep_their_place_in_the_curriculum(unbroken, tmp_path, monkeypatch):
    monkeypatch.setattr(RolloutEnv, "can_be_restored", False)
    for made in (2, 1):
        with closing(make_training(tmp_path / "run").run()) as reports:
            assert len(list(islice(reports, made))) == made
    ours, whole = (
        [row["action_scale_rad"] for row in curve(out / "training.csv")] for out in (tmp_path / "run", unbroken)
    )
    assert ours == whole[:3]


def test_interrupted_during_a_look_it_loses_one_iteration_and_makes_it_again(unbroken, tmp_path):
    def interrupt(*_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        list(make_training(tmp_path / "run", observe=interrupt).run())
    training = make_training(tmp_path / "run")
    assert training.standing.iteration == 3
    assert len(list(training.run())) == 7
    assert outcome(tmp_path / "run") == outcome(unbroken)


def test_killed_and_continued_it_is_the_unbroken_run(unbroken, tmp_path):
    kill_after(5, "tests.dapl_baselines.policy.small_training", tmp_path / "run")
    assert len(list(make_training(tmp_path / "run").run())) > 0
    assert outcome(tmp_path / "run") == outcome(unbroken)


def test_a_training_can_be_made_longer_and_nothing_else(unbroken, tmp_path):
    folder = tmp_path / "run"
    list(make_training(folder, SETTINGS.model_copy(update={"iterations": 1})).run())
    reports = list(make_training(folder, SETTINGS.model_copy(update={"iterations": 2})).run())
    assert [report.iteration for report in reports] == [2]
    with pytest.raises(InvalidValueError, match=r"settings\.envs was 4, is 5"):
        make_training(folder, SETTINGS.model_copy(update={"envs": 5}))


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InvalidValueError, match="neither an empty folder nor a policy training"):
        make_training(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda state: state.update(format="another"), "not the state of this training"),
        (lambda state: state.pop("environments"), "KeyError"),
        (lambda state: state["environments"].update(scene_ids=["boxes-9"] * 4), "unknown scene"),
        (lambda state: state["environments"].update(states=torch.zeros(4, 3).double()), "cannot be taken up"),
        (lambda state: state["environments"].update(seeds=[1]), "1 seeds for 4"),
        (lambda state: state["algorithm"]["actor_state_dict"].popitem(), "RuntimeError"),
        (lambda state: state.update(random=torch.zeros(3)), "TypeError"),
    ],
)
def test_a_damaged_state_is_refused_in_one_line(unbroken, tmp_path, change, said):
    state = torch.load(unbroken / "state.pt", weights_only=True)
    change(state)
    (tmp_path / "run.json").write_text((unbroken / "run.json").read_text())
    torch.save(state, tmp_path / "state.pt")
    with pytest.raises(InvalidFileError, match=said) as caught:
        make_training(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_state_is_read_without_running_what_it_holds(unbroken, tmp_path):
    class Bomb:
        def __reduce__(self):
            return Path.touch, (tmp_path / "exploded",)

    (tmp_path / "run.json").write_text((unbroken / "run.json").read_text())
    torch.save({"format": Bomb()}, tmp_path / "state.pt")
    with pytest.raises(InvalidFileError, match="could run code"):
        make_training(tmp_path)
    assert not (tmp_path / "exploded").exists()


def test_run_json_names_everything_that_counts(unbroken):
    record = json.loads((unbroken / "run.json").read_text())
    assert set(record) == {
        "schema_version", "settings", "training_sha256", "validation_sha256", "encoder_sha256", "start_sha256", "device"
    }  # fmt: skip
    assert record["settings"]["network"]["encoder"]["name"] == "dapl"
