"""A data set is found by name or folder, and what is not the frozen thing is refused."""

import shutil

import pytest

import clutter6d
from clutter6d.dataset.dataset import Dataset, dataset_names, open_dataset
from clutter6d.dataset.scenes import find_scenes, open_scenes, split_names
from clutter6d.errors import InvalidFileError, MissingFileError, UnknownNameError


@pytest.fixture
def copied(frozen, tmp_path):
    return shutil.copytree(frozen, tmp_path / "copied")


def test_the_package_brings_its_own_data_sets():
    assert "clutter6d-v1" in dataset_names()
    assert {"sparse-train", "sparse-test", "moderate-test", "dense-test"} <= set(split_names())


def test_load_split_reads_what_the_manifest_counts():
    split = clutter6d.load_split("moderate-test")
    assert len(split) == 128
    scene = split[0]
    assert len(scene.objects) == 8
    assert len(scene.goal_pairs) == 16
    assert set(split.assets_of(scene)) == {item.asset_hash for item in scene.objects}


def test_an_unknown_split_is_answered_with_the_nearest():
    with pytest.raises(UnknownNameError, match="did you mean 'dense-test'"):
        clutter6d.load_split("dense-tets")


def test_an_unknown_data_set_is_answered_with_those_there_are():
    with pytest.raises(UnknownNameError, match="clutter6d-v1"):
        open_dataset("clutter6d-v2")


def test_a_pool_holds_the_assets_of_its_splits_only(dataset):
    train = dataset.pool("train")
    assert len(train.names()) == 6
    assert set(train.index()["name"]) == set(train.names())
    with pytest.raises(UnknownNameError):
        train.load("test-box-000")


@pytest.mark.parametrize("file", ["assets.parquet", "sparse-test.parquet", "asset_list.csv"])
def test_a_file_with_one_other_byte_is_refused(copied, file):
    content = bytearray((copied / file).read_bytes())
    content[len(content) // 2] ^= 1
    (copied / file).write_bytes(content)
    with pytest.raises(InvalidFileError):
        _ = (Dataset(copied).split("sparse-test"), Dataset(copied).asset_list)


def test_assets_that_are_not_installed_are_named_with_the_command(copied, tmp_path, monkeypatch):
    manifest = copied / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"ships_assets": true', '"ships_assets": false'))
    monkeypatch.setenv("CLUTTER6D_CACHE", str(tmp_path / "cache"))
    with pytest.raises(MissingFileError, match="clutter6d dataset install boxes-v1"):
        Dataset(copied).split("sparse-test")


def test_open_scenes_takes_a_folder_or_a_split(frozen, workshop):
    folder, split = open_scenes(workshop.split_path("sparse-test")), open_scenes(f"{frozen}/sparse-test")
    assert folder.sha256 == split.sha256
    with pytest.raises(UnknownNameError, match="folder of scenes or split"):
        open_scenes("nowhere")
    with pytest.raises(MissingFileError, match="clutter6d generate"):
        open_scenes(frozen)


def test_find_scenes_takes_one_scene_of_either(frozen, workshop):
    folder = workshop.split_path("sparse-test")
    for where in (folder / "scenes" / "sparse-2-00001", f"{frozen}/sparse-test/sparse-2-00001"):
        _, found = find_scenes(where)
        assert [scene.scene_id for scene in found] == ["sparse-2-00001"]
    assert len(find_scenes(f"{frozen}/sparse-test")[1]) == 2
    with pytest.raises(UnknownNameError, match="sparse-2-00001"):
        find_scenes(f"{frozen}/sparse-test/sparse-2-0001")
