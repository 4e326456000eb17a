"""Verification passes on what was frozen, and finds every kind of change."""

import hashlib
import json
import shutil

import pyarrow.parquet as pq
import pytest

from clutter6d.dataset.dataset import Dataset
from clutter6d.dataset.split import Split
from clutter6d.dataset.verify import (
    check_engine,
    choose_scenes,
    verify_assets,
    verify_files,
    verify_in_processes,
    verify_pools,
    verify_scenes,
)
from clutter6d.errors import InvalidValueError


def problems(findings) -> list[str]:
    return [problem for finding in findings for problem in finding.problems]


@pytest.fixture
def copied(frozen, tmp_path):
    return shutil.copytree(frozen, tmp_path / "copied")


def rewrite(folder, file, change):
    """Change rows of a split and let the manifest agree, as somebody would who wants not to be found out."""
    table = pq.read_table(folder / file)
    rows = table.to_pylist()
    change(rows)
    pq.write_table(type(table).from_pylist(rows, schema=table.schema), folder / file)
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["files"][file] = hashlib.sha256((folder / file).read_bytes()).hexdigest()
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return Dataset(folder)


def pool_of(dataset: Dataset, split: Split) -> frozenset[str]:
    rows = dataset.asset_list
    return frozenset(rows["name"][rows["pool"] == split.entry.pool])


def test_what_was_frozen_has_no_problems(dataset):
    assert problems(verify_files(dataset)) == []
    assert problems(verify_pools(dataset)) == []
    assert problems(verify_assets(dataset)) == []
    for name in dataset.split_names:
        split = dataset.split(name)
        assert problems(verify_scenes(split, pool_of(dataset, split))) == []
        assert problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=False, workers=1)) == []
        assert problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=True, workers=1)) == []


def test_a_changed_and_an_added_file_are_found(copied):
    (copied / "asset_list.csv").write_text((copied / "asset_list.csv").read_text().replace("0.5", "0.6", 1))
    (copied / "extra.bin").write_bytes(b"?")
    found = problems(verify_files(Dataset(copied)))
    assert len(found) == 2
    assert "asset_list.csv" in found[0]
    assert "extra.bin" in found[1]


def test_an_asset_of_another_pool_is_found(dataset):
    split = dataset.split("sparse-test")
    found = problems(verify_scenes(split, pool_of(dataset, dataset.split("sparse-train"))))
    assert len(found) == 2
    assert "not of pool test" in found[0]


def test_a_scene_that_was_changed_does_not_have_its_hash(copied):
    def nudge(rows):
        rows[0]["goal_pairs"][0]["goal"][0] += 1e-9

    dataset = rewrite(copied, "sparse-test.parquet", nudge)
    split = dataset.split("sparse-test")
    assert any("does not have its hash" in line for line in problems(verify_scenes(split, pool_of(dataset, split))))


def test_a_scene_whose_hash_was_changed_with_it_breaks_the_split_s_hash(copied):
    def forge(rows):
        rows[0]["scene_sha256"] = "0" * 64

    dataset = rewrite(copied, "sparse-test.parquet", forge)
    split = dataset.split("sparse-test")
    found = problems(verify_scenes(split, pool_of(dataset, split)))
    assert any("do not have the split's hash" in line for line in found)


@pytest.mark.parametrize(("lift", "reason"), [(0.02, "drifted"), (-0.004, "overlap|drifted"), (-0.5, "fell")])
def test_a_state_that_does_not_hold_is_found_by_simulation(copied, lift, reason):
    def raise_goal(rows):
        rows[1]["goal_pairs"][2]["goal"][2] += lift

    dataset = rewrite(copied, "sparse-test.parquet", raise_goal)
    split = dataset.split("sparse-test")
    found = problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=False, workers=1))
    assert len(found) == 1
    assert "pair 2, goal" in found[0]
    assert any(word in found[0] for word in reason.split("|"))


def test_a_scene_that_its_seed_does_not_give_is_found(copied):
    def swap(rows):
        rows[0]["index"], rows[1]["index"] = rows[1]["index"], rows[0]["index"]

    dataset = rewrite(copied, "sparse-test.parquet", swap)
    split = dataset.split("sparse-test")
    found = problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=True, workers=1))
    assert len(found) == 2
    assert "gives another scene" in found[0]


def test_workers_find_the_same(copied):
    def raise_goal(rows):
        rows[1]["goal_pairs"][2]["goal"][2] += 0.02

    dataset = rewrite(copied, "sparse-test.parquet", raise_goal)
    split = dataset.split("sparse-test")
    alone = problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=False, workers=1))
    assert problems(verify_in_processes(dataset, split, split.scene_ids, regenerate=False, workers=2)) == alone


def test_scenes_are_chosen_the_same_every_time(dataset):
    split = dataset.split("sparse-train")
    assert choose_scenes(split, 2) == choose_scenes(split, 2)
    assert choose_scenes(split, 99) == split.scene_ids


def test_scenes_are_not_made_anew_with_another_engine(copied):
    manifest = copied / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"engine": "mujoco ', '"engine": "mujoco 3.'))
    with pytest.raises(InvalidValueError, match="install that"):
        check_engine(Dataset(copied))
