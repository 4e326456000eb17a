"""Clutter6D v1 as it lies in the repository: its hashes, what it promises, and scenes in the simulator."""

import numpy as np
import pytest

import clutter6d
from clutter6d.dataset.dataset import Dataset, open_dataset
from clutter6d.dataset.verify import verify_files, verify_in_processes, verify_pools, verify_sources
from clutter6d.eval.report import OFFICIAL_SPLITS
from clutter6d.scenegen.track import find_track


@pytest.fixture(scope="module")
def v1() -> Dataset:
    return open_dataset("clutter6d-v1")


def test_every_file_has_the_hash_of_the_manifest(v1):
    assert [problem for finding in (*verify_files(v1), *verify_pools(v1)) for problem in finding.problems] == []


def test_the_official_splits_are_its_test_splits(v1):
    assert {e.track: e.scenes_sha256 for e in v1.manifest.splits if e.name.endswith("-test")} == OFFICIAL_SPLITS


@pytest.mark.parametrize(
    ("name", "scenes"), [("sparse-train", 1024), ("sparse-test", 128), ("moderate-test", 128), ("dense-test", 128)]
)
def test_each_split_has_its_scenes_and_sixteen_pairs_each(v1, name, scenes):
    entry = next(entry for entry in v1.manifest.splits if entry.name == name)
    assert (entry.scenes, entry.pairs) == (scenes, 16 * scenes)
    assert len(v1.split(name)) == scenes


def test_train_and_test_share_no_object_and_a_quarter_of_the_test_objects_is_of_new_families(v1):
    rows = v1.asset_list
    train, test = rows[rows["pool"] == "train"], rows[rows["pool"] == "test"]
    assert len(train) >= 1000
    assert len(test) >= 250
    assert not set(train["content_hash"]) & set(test["content_hash"])
    assert not set(train["source_id"]) & set(test["source_id"])
    is_new = ~test["category"].isin(set(train["category"]))
    assert is_new.mean() >= 0.25
    for pool in (train, test):
        assert pool["category"].value_counts().nunique() == 1


@pytest.mark.parametrize("name", ["sparse-test", "moderate-test", "dense-test"])
def test_targets_start_and_end_where_the_paper_has_them(name):
    split = clutter6d.load_split(name)
    pairs, region = split.to_pandas(), find_track(split.entry.track).target_region
    for state in ("initial", "goal"):
        assert pairs[f"{state}_x"].between(region.x[0] - 0.002, region.x[1] + 0.002).all()
        assert pairs[f"{state}_y"].between(region.y[0] - 0.002, region.y[1] + 0.002).all()
    assert pairs["planar_displacement_m"].min() >= 0.15


def test_obstacles_matter_and_the_more_the_denser():
    blocked = [clutter6d.load_split(f"{track}-test").to_pandas()["is_path_blocked"].mean() for track in OFFICIAL_SPLITS]
    assert blocked == sorted(blocked)
    assert np.all(np.diff(blocked) > 0.1)
    assert blocked[0] > 0.25


def test_its_assets_are_what_their_sources_give(v1):
    findings = list(verify_sources(v1, 4))
    assert len(findings) == 8
    assert [problem for finding in findings for problem in finding.problems] == []


@pytest.mark.parametrize("name", ["sparse-train", "sparse-test", "moderate-test", "dense-test"])
def test_a_scene_holds_in_the_simulator_and_its_seed_makes_it_again(v1, name):
    split = v1.split(name)
    chosen = split.scene_ids[len(split) // 2 :][:1]
    for regenerate in (False, True):
        findings = verify_in_processes(v1, split, chosen, regenerate=regenerate, workers=1)
        assert [problem for finding in findings for problem in finding.problems] == []
