from pathlib import Path

import pytest
from pydantic import ValidationError

from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.contact_pretraining import training
from dapl_baselines.contact_pretraining.contact_model import ContactModelConfig
from dapl_baselines.contact_pretraining.examples import ContactShapes, draw_examples
from dapl_baselines.contact_pretraining.settings import PRESETS, ContactSettings
from dapl_baselines.contact_pretraining.training import ContactTraining
from dapl_baselines.policy.encoder_source import open_encoder
from tests.dapl_baselines.contact_pretraining.small_contacts import SETTINGS, make_boxes, make_training
from tests.dapl_baselines.interrupted import curve, kill_after


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("unbroken") / "run"
    reports = list(make_training(folder).run())
    assert [report.step for report in reports] == [2, 4, 6, 8, 10, 12]
    assert [report.errors is not None for report in reports] == [False, True] * 3
    return folder


def outcome(folder: Path) -> tuple[object, ...]:
    header = read_checkpoint(folder / "corn.pt").header
    return curve(folder / "losses.csv"), curve(folder / "validation.csv"), header.weights_sha256, header.history


def test_it_leaves_curves_and_an_encoder_that_says_where_it_is_from(unbroken):
    assert [int(row["step"]) for row in curve(unbroken / "losses.csv")] == [2, 4, 6, 8, 10, 12]
    assert [int(row["step"]) for row in curve(unbroken / "validation.csv")] == [4, 8, 12]
    source = open_encoder(str(unbroken / "corn.pt"), 0)
    assert source.config == SETTINGS.model.encoder
    assert [record.method for record in source.history] == ["contacts"]


def test_killed_and_continued_it_is_the_unbroken_run_to_the_bit(unbroken, tmp_path):
    kill_after(6, "tests.dapl_baselines.contact_pretraining.small_contacts", tmp_path / "run")
    again = make_training(tmp_path / "run")
    assert again.step in {6, 8}
    list(again.run())
    assert outcome(tmp_path / "run") == outcome(unbroken)


def test_a_finished_training_is_not_made_again(unbroken):
    assert list(make_training(unbroken).run()) == []
    assert make_training(unbroken).best is not None


def test_it_learns_a_few_examples_by_heart(tmp_path, monkeypatch):
    few = draw_examples(ContactShapes.of(make_boxes()), SETTINGS.examples, 16, generator(0, "few"))
    monkeypatch.setattr(training, "draw_examples", lambda *_: few)
    change = {"steps": 150, "learning_rate": 2e-3, "save_every": 150, "evaluate_every": 150}
    settings = SETTINGS.model_copy(update={**change, "model": ContactModelConfig()})
    (last,) = make_training(tmp_path / "run", settings).run()
    assert last.errors.loss < 0.2 * last.errors.floor
    assert min(last.errors.precision, last.errors.recall) > 0.9


def test_a_folder_belongs_to_one_training(unbroken):
    with pytest.raises(InvalidValueError, match=r"settings.seed was 0, is 1"):
        make_training(unbroken, SETTINGS.model_copy(update={"seed": 1}))


def test_a_damaged_state_is_refused(tmp_path):
    next(make_training(tmp_path / "run").run())
    (tmp_path / "run" / "state.pt").write_bytes(b"nonsense")
    with pytest.raises(InvalidFileError, match=r"state\.pt"):
        make_training(tmp_path / "run")


def test_one_object_is_too_few(tmp_path):
    with pytest.raises(InvalidValueError, match="give at least 2"):
        ContactTraining(make_boxes()[:1], "0" * 64, SETTINGS, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_looks_must_be_saved():
    with pytest.raises(ValidationError, match="not a multiple"):
        ContactSettings(save_every=50, evaluate_every=75)


@pytest.mark.parametrize("settings", PRESETS.values())
def test_the_learning_rate_rises_and_falls(settings):
    rates = [settings.learning_rate_at(step) for step in range(settings.steps)]
    top = rates.index(max(rates))
    assert abs(top - settings.warmup_steps) <= 1
    assert rates[0] < 0.2 * rates[top]
    assert rates[-1] < 0.02 * rates[top]
