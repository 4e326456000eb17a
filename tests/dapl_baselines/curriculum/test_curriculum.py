"""``dapl curriculum`` as a user meets it: two rounds, killed in several places, and refusals."""

import csv
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from clutter6d.errors import InvalidValueError
from clutter6d.schema import write_model
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.curriculum.curriculum import Curriculum
from dapl_baselines.curriculum.settings import CurriculumSettings
from dapl_baselines.interactions.dataset import open_interactions
from dapl_baselines.validation import open_training_scenes
from tests.dapl_baselines.curriculum.small_curriculum import SETTINGS, run_command
from tests.dapl_baselines.world_model.tiny import TINY_MODEL
from tests.scene_fixtures import write_box_scene_set

ROOT = Path(__file__).parents[3]
STATES = ("training.pt", "state.pt")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("curriculum")
    write_box_scene_set(folder / "scenes", 3)
    write_model(folder / "tiny.json", TINY_MODEL)
    return folder


@pytest.fixture(scope="module")
def unbroken(folder):
    assert run_command(folder, "unbroken") == 0
    return folder / "unbroken"


def table(out: Path) -> list[dict[str, str]]:
    """All columns but those that take the time."""
    with (out / "curriculum.csv").open() as file:
        return [{k: v for k, v in row.items() if not k.startswith("timing_")} for row in csv.DictReader(file)]


def weights(out: Path) -> list[str]:
    return [
        read_checkpoint(path).header.weights_sha256
        for path in sorted(out.glob("round-*/*/*.pt"))
        if path.name not in STATES
    ]


def history(path: Path) -> list[str]:
    return [record.method for record in read_checkpoint(path).header.history]


def test_every_round_has_a_row_with_the_floors_and_the_success(unbroken):
    rows = table(unbroken)
    found = [(row["round"], row["recorded_steps"], row["episodes"]) for row in rows]
    assert found == [("1", "200", "1"), ("2", "400", "1")]
    for row in rows:
        assert int(row["moving_clouds"]) > 0
        assert all(float(row[f"{name}_error_cm"]) > 0 for name in ("world_model", "copy", "constant_velocity"))
        assert {"success_rate", "mean_offset_cm"} <= set(row)
    assert (unbroken / "curriculum.png").read_bytes().startswith(b"\x89PNG")


def test_the_first_round_records_the_sweep_and_the_second_the_first_policy(unbroken):
    first, second = (open_interactions([unbroken / f"round-{number}" / "interactions"]) for number in (1, 2))
    assert sorted(header.policy for header in first.headers) == ["random", "sweep"]
    (header,) = second.headers
    policy = read_checkpoint(unbroken / "round-1" / "policy" / "policy.pt").header
    assert header.policy_hash == policy.policy_hash()


def test_each_round_goes_on_with_what_the_round_before_learned(unbroken):
    both = ["world-model", "world-model"]
    assert history(unbroken / "round-2" / "world-model" / "world-model.pt") == both
    assert history(unbroken / "round-1" / "policy" / "policy.pt") == ["world-model", "ppo"]
    assert history(unbroken / "round-2" / "policy" / "policy.pt") == ["world-model", "ppo", "world-model", "ppo"]


@pytest.mark.parametrize(
    "place",
    [
        "round 2 of 2: world model 500",
        pytest.param("round 1 of 2: interactions 80", marks=pytest.mark.slow),
        pytest.param("round 1 of 2: errors on held-out scenes 1", marks=pytest.mark.slow),
        pytest.param("round 2 of 2: policy 2", marks=pytest.mark.slow),
        pytest.param("round 2 of 2: validation 1", marks=pytest.mark.slow),
    ],
)
def test_killed_in_the_midst_of_a_stage_and_continued_it_is_the_unbroken_run(folder, unbroken, place):
    out = f"killed at {place}"
    command = [sys.executable, "-m", "tests.dapl_baselines.curriculum.small_curriculum", str(folder), out]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "DIE_AT": place}
    killed = subprocess.run(command, cwd=ROOT, env=environment, timeout=600, capture_output=True, check=False)
    assert killed.returncode == -signal.SIGKILL, killed.stderr.decode()
    assert run_command(folder, out) == 0
    assert table(folder / out) == table(unbroken)
    assert weights(folder / out) == weights(unbroken)


def test_the_same_command_again_changes_nothing(folder, unbroken, capsys):
    before = {path: path.read_bytes() for path in unbroken.rglob("*") if path.is_file()}
    assert run_command(folder, "unbroken") == 0
    assert "2 rounds are made" in capsys.readouterr().out
    assert {path: path.read_bytes() for path in unbroken.rglob("*") if path.is_file()} == before


def test_it_can_be_given_more_rounds_and_nothing_else(folder, unbroken):
    scenes, name = open_training_scenes(folder / "scenes"), str(folder / "scenes")
    settings = SETTINGS.model_copy(update={"model": TINY_MODEL, "rounds": 3})
    assert len(Curriculum(scenes, settings, unbroken, scenes_name=name).results) == 2
    with pytest.raises(InvalidValueError, match=r"settings\.record_steps was 200, is 300"):
        Curriculum(scenes, settings.model_copy(update={"record_steps": 300}), unbroken, scenes_name=name)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--preset", "labtop"), "unknown preset 'labtop'; did you mean 'laptop'?"),
        (("--scenes", "sparse-test"), "scenes of sparse-test; train on sparse-train"),
        (("--model", "point"), "did you mean 'points'?"),
        (("--device", "tpu"), "device 'tpu' is unknown"),
        (("--rounds", "101"), "rounds is 101: Input should be less than or equal to 100"),
        (("--envs", "2000000"), "envs is 2000000"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(folder, capsys, options, said):
    assert run_command(folder, "mistake", *options) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (folder / "mistake").exists()


def test_a_folder_of_something_else_is_left_alone(folder, capsys):
    (folder / "mine").mkdir()
    (folder / "mine" / "notes.txt").write_text("years of work")
    assert run_command(folder, "mine") == 2
    assert "neither an empty folder nor a curriculum" in capsys.readouterr().err
    assert [path.name for path in (folder / "mine").iterdir()] == ["notes.txt"]


def test_no_two_rounds_have_the_same_seed():
    settings = [CurriculumSettings(seed=seed) for seed in range(3)]
    assert len({one.seed_of(number) for one in settings for number in range(1, 9)}) == 24
