"""``dapl train world-model`` and ``dapl show-predictions`` as a user meets them."""

import csv
import io

import pytest
from PIL import Image

from clutter6d.cli import run
from clutter6d.schema import read_model, write_model
from dapl_baselines.cli import PROGRAM
from dapl_baselines.world_model.evaluation import PREDICTORS
from dapl_baselines.world_model.metrics import POINT_SETS
from dapl_baselines.world_model.report import Report, share_under_floors
from dapl_baselines.world_model.train_config import RunConfig, find_train_preset
from tests.dapl_baselines.world_model.tiny import TINY_MODEL


@pytest.fixture(scope="module", autouse=True)
def short_reports():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dapl_baselines.world_model.final_report.TRAINED_ON_CLOUDS", 8)
        yield


@pytest.fixture(scope="module")
def trained(pushed_boxes, tmp_path_factory):
    folder = tmp_path_factory.mktemp("command")
    write_model(folder / "tiny.json", TINY_MODEL)
    assert train(pushed_boxes, folder / "out", folder / "tiny.json") == 0
    return folder


def train(data, out, model, *options) -> int:
    command = ["train", "world-model", "--data", data, "--out", out, "--model", model, "--device", "cpu"]
    return run([str(word) for word in [*command, "--steps", "20", "--rows", "4", *options]], PROGRAM)


def test_the_report_has_the_model_and_both_floors_side_by_side(trained):
    report = read_model(trained / "out" / "report.json", Report, what="report")
    for errors in (report.held_out, report.trained_on):
        assert set(errors) == set(POINT_SETS)
        for row in errors.values():
            assert set(row) == set(PREDICTORS)
            assert len({predictor.clouds for predictor in row.values()}) == 1
    assert (report.data.training, report.data.validation) == (80, 40)
    assert (report.steps, report.best_step) == (20, 20)
    page = (trained / "out" / "report.md").read_text()
    assert "copy the input" in page
    assert "constant velocity" in page
    assert ("ABOVE" in page) == (share_under_floors(report.held_out, "moving_objects") < 0)


def test_what_is_not_given_is_the_presets(trained):
    config = read_model(trained / "out" / "config.json", RunConfig, what="training")
    laptop = find_train_preset("laptop")
    assert (config.train.steps, config.train.batch.rows) == (20, 4)
    assert config.loss == laptop.loss
    assert config.train.minutes == laptop.train.minutes
    assert config.train.batch.moving_share == laptop.train.batch.moving_share


def test_the_same_command_again_changes_nothing(trained, pushed_boxes):
    files = [trained / "out" / name for name in ("report.json", "report.md", "losses.csv", "world-model.pt")]
    before = [path.read_bytes() for path in files]
    assert train(pushed_boxes, trained / "out", trained / "tiny.json") == 0
    assert [path.read_bytes() for path in files] == before


def test_the_curve_of_held_out_scenes_has_the_errors(trained):
    with (trained / "out" / "validation.csv").open() as file:
        (row,) = csv.DictReader(file)
    report = read_model(trained / "out" / "report.json", Report, what="report")
    assert float(row["chamfer_cm"]) == pytest.approx(report.held_out["moving_objects"]["model"].chamfer_cm, rel=1e-4)


@pytest.mark.parametrize("model", ["reconstruction", "object-xyz"])
def test_ablations_are_trained_by_name(model, tmp_path, pushed_boxes, monkeypatch):
    from dapl_baselines.world_model import presets

    monkeypatch.setattr("dapl_baselines.world_model.final_report.HELD_OUT_CLOUDS", 8)
    kept = presets.PRESETS[model]
    encoder = TINY_MODEL.encoder.model_copy(update={"features": kept.encoder.features})
    monkeypatch.setitem(presets.PRESETS, model, kept.model_copy(update={"encoder": encoder}))
    assert train(pushed_boxes, tmp_path / "out", model) == 0
    assert (tmp_path / "out" / "report.json").is_file()


def test_predictions_are_drawn(trained, pushed_boxes, capsys, monkeypatch):
    monkeypatch.setattr("dapl_baselines.world_model.picture._MOVING_POINTS", 1)
    picture = trained / "predictions.png"
    options = ["--data", pushed_boxes, "--model", trained / "out" / "world-model.pt", "--out", picture, "--count", "1"]
    assert run(["show-predictions", *map(str, options)], PROGRAM) == 0
    assert Image.open(io.BytesIO(picture.read_bytes())).width > 1000
    assert run(["show-predictions", *map(str, [*options[:-1], 12])], PROGRAM) == 2
    assert "choose fewer rows" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--preset", "desktop"], "unknown training preset 'desktop'"),
        (["--device", "tpu"], "device 'tpu'"),
        (["--rows", "70000"], "rows is 70000: Input should be less than or equal to 65536"),
        (["--model", "point"], "did you mean 'points'?"),
        (["--model", "missing.json"], "configuration of a world model not found"),
        (["--data", "nowhere"], "make one with: dapl record"),
    ],
)
def test_mistakes_are_one_line(options, message, tmp_path, pushed_boxes, capsys):
    assert train(pushed_boxes, tmp_path / "out", "points", *options) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
