from dataclasses import replace

import pytest

from clutter6d.cli import run
from clutter6d.dataset.scenes import SceneCollection, load_split
from clutter6d.errors import InvalidValueError
from dapl_baselines.cli import PROGRAM
from dapl_baselines.validation import open_training_scenes, part_scenes
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set


def test_of_1024_scenes_the_last_64_are_held_out():
    some = make_box_scene_set(1)
    scenes = tuple(replace(some.scenes[0], scene_id=f"boxes-{number:04}") for number in range(1024))
    parted = part_scenes(replace(some, scenes=scenes))
    assert parted.training.scenes + parted.validation.scenes == scenes
    assert len(parted.validation.scenes) == 64


@pytest.mark.slow
def test_the_last_64_scenes_of_sparse_train_are_held_out():
    split, parted = load_split("sparse-train"), open_training_scenes("sparse-train")
    names = [scene.scene_id for scene in (*parted.training.scenes, *parted.validation.scenes)]
    assert tuple(names) == split.scene_ids
    assert len(parted.validation.scenes) == 64


def test_each_part_is_a_collection_with_a_name_of_its_own():
    whole = make_box_scene_set(3)
    parted = part_scenes(whole)
    assert isinstance(parted.training, SceneCollection)
    assert len({whole.sha256, parted.training.sha256, parted.validation.sha256}) == 3
    assert parted.validation.sha256 == part_scenes(make_box_scene_set(3)).validation.sha256
    scene = parted.validation.scenes[0]
    assert parted.validation.assets_of(scene).keys() == whole.assets_of(scene).keys()


def test_a_test_split_is_refused():
    with pytest.raises(InvalidValueError, match="dense-test; train on sparse-train"):
        open_training_scenes("dense-test")


def test_a_single_scene_cannot_be_parted():
    with pytest.raises(InvalidValueError, match="give at least 2"):
        part_scenes(make_box_scene_set(1))


def test_the_command_says_how_a_policy_does_on_the_scenes_that_are_held_out(tmp_path, capsys):
    write_box_scene_set(tmp_path / "scenes", 3)
    split = ["--split", str(tmp_path / "scenes"), "--threads", "1"]
    assert run(["validate", "--policy", "zero", "--pairs", "2", *split], PROGRAM) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "zero: 0.0% of 2 episodes succeed; an episode takes 300 steps" in said


def test_the_command_refuses_test_splits(capsys):
    assert run(["validate", "--policy", "zero", "--split", "sparse-test"], PROGRAM) == 2
    assert "sparse-test; train on sparse-train" in capsys.readouterr().err
