"""Clutter6D real v1 as it lies in the repository: scenes over meshes that it does not carry."""

from pathlib import Path

import pytest

from clutter6d.assets.cache import CACHE_VARIABLE
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.registry import make_source
from clutter6d.dataset.dataset import Dataset, open_dataset
from clutter6d.dataset.split_file import SplitFile
from clutter6d.dataset.verify import verify_files, verify_in_processes, verify_pools
from clutter6d.errors import MissingFileError

SPLITS = {"sparse-test": (128, 4), "moderate-test": (128, 8), "dense-test": (64, 12)}


@pytest.fixture(scope="module")
def real_v1() -> Dataset:
    return open_dataset("clutter6d-real-v1")


def test_every_file_has_the_hash_of_the_manifest(real_v1: Dataset) -> None:
    findings = (*verify_files(real_v1), *verify_pools(real_v1))
    assert [problem for finding in findings for problem in finding.problems] == []


def test_it_carries_no_mesh_and_is_small(real_v1: Dataset) -> None:
    assert not real_v1.manifest.ships_assets
    assert {path.suffix for path in real_v1.path.iterdir()} == {".json", ".csv", ".parquet"}
    assert sum(path.stat().st_size for path in real_v1.path.iterdir()) < 2_000_000


def test_before_the_installation_the_message_says_what_to_run(
    real_v1: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path))
    with pytest.raises(MissingFileError, match="clutter6d dataset install clutter6d-real-v1"):
        open_dataset("clutter6d-real-v1").split("dense-test")


@pytest.mark.parametrize("name", SPLITS)
def test_each_scene_has_sixteen_pairs_and_names_listed_assets_by_hash(real_v1: Dataset, name: str) -> None:
    scenes, objects = SPLITS[name]
    file = SplitFile(real_v1.path / f"{name}.parquet")
    assert len(file.scene_ids) == scenes
    listed = set(real_v1.asset_list["content_hash"])
    for index in range(scenes):
        scene = file.read(index)
        assert len(scene.goal_pairs) == 16
        assert len({item.asset_hash for item in scene.objects}) == objects
        assert {item.asset_hash for item in scene.objects} <= listed


def test_each_asset_has_a_free_licence_and_an_author(real_v1: Dataset) -> None:
    rows = real_v1.asset_list
    assert len(rows) == 116
    assert set(rows["licence"]) == {"CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US"}
    assert (rows["author"].str.len() > 0).all()
    assert rows["size_class"].value_counts().to_dict() == {"small": 75, "large": 41}


def test_each_object_that_was_left_out_has_a_reason(real_v1: Dataset) -> None:
    excluded = real_v1.manifest.pools["test"].options["excluded"]
    assert len(excluded) == 195
    assert all(len(reason) > 4 for reason in excluded.values())
    assert not set(excluded) & set(real_v1.asset_list["source_id"])


@pytest.mark.real
def test_the_catalogue_lists_exactly_its_objects_and_a_few_become_the_frozen_assets(
    real_v1: Dataset, tmp_path: Path
) -> None:
    pool, rows = real_v1.manifest.pools["test"], real_v1.asset_list
    source = make_source(pool.source, **pool.options)
    items = source.objects()
    assert sorted(item.licence.source_id for item in items) == sorted(rows["source_id"])
    settings = ProcessingSettings()
    library = AssetLibrary.create(tmp_path / "library", settings_as_stored(settings))
    frozen = dict(zip(rows["source_id"], rows["content_hash"], strict=True))
    for record in run(source, items[:40:10], library, settings, RunSettings()):
        assert record.asset_hash == frozen[record.key], record.asset_name


@pytest.mark.real
@pytest.mark.slow
@pytest.mark.parametrize("name", SPLITS)
def test_scenes_hold_in_the_simulator_and_come_from_their_seeds(real_v1: Dataset, name: str) -> None:
    if not real_v1.library_path.is_dir():
        pytest.skip("its assets are not installed: clutter6d dataset install clutter6d-real-v1")
    split = real_v1.split(name)
    chosen = split.scene_ids[:2]
    for regenerate in (False, True):
        for finding in verify_in_processes(real_v1, split, chosen, regenerate=regenerate, workers=1):
            assert finding.problems == ()
