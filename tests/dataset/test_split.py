"""A frozen split gives back the scenes it was made from, lazily, and speaks pandas."""

import numpy as np
import pyarrow.parquet as pq
import pytest

from clutter6d.dataset.split_file import SplitFile
from clutter6d.errors import InvalidFileError, UnknownNameError
from clutter6d.scene_file import scene_sha256, scene_to_file
from clutter6d.scenegen.scene_set import SceneSet


def test_its_scenes_are_those_of_the_folder_to_the_bit(dataset, workshop):
    made, split = SceneSet.open(workshop.split_path("sparse-train")), dataset.split("sparse-train")
    assert [scene_to_file(scene) for scene in split.scenes] == [scene_to_file(scene) for scene in made.scenes]


def test_its_hash_is_that_of_the_folder(dataset, workshop):
    assert dataset.split("sparse-train").sha256 == SceneSet.open(workshop.split_path("sparse-train")).sha256


def test_each_scene_has_its_stored_hash(dataset):
    split = dataset.split("sparse-test")
    assert {scene.scene_id: scene_sha256(scene) for scene in split.scenes} == dict(split.scene_sha256)


def test_a_scene_is_found_by_position_and_by_id(dataset):
    split = dataset.split("sparse-train")
    assert len(split) == 3
    assert split[1].scene_id == split["sparse-1-00001"].scene_id == "sparse-1-00001"
    assert split[-1].scene_id == "sparse-1-00002"
    with pytest.raises(IndexError):
        split[3]
    with pytest.raises(UnknownNameError, match="sparse-1-00000"):
        split["sparse-1-0000"]


def test_its_assets_are_read_and_checked(dataset):
    split = dataset.split("sparse-test")
    assets = split.assets_of(split[0])
    assert {item.asset_hash for item in split[0].objects} == set(assets)
    assert all(asset.name.startswith("test-box") for asset in assets.values())


def test_to_pandas_has_one_row_a_goal_pair(dataset):
    split = dataset.split("sparse-test")
    table = split.to_pandas()
    assert len(table) == 2 * 16
    first = split[0].goal_pairs[3]
    row = table[(table["scene_id"] == split[0].scene_id) & (table["pair"] == 3)].iloc[0]
    np.testing.assert_array_equal(row[["goal_x", "goal_y", "goal_z"]].to_numpy(float), first.goal.position)
    assert row["planar_displacement_m"] == first.planar_displacement_m >= 0.15
    assert 0 <= row["rotation_rad"] <= np.pi + 1e-9


def test_what_was_discarded_is_kept(dataset, workshop):
    made = SceneSet.open(workshop.split_path("sparse-train"))
    expected = [made.record(scene.scene_id).failures for scene in made.scenes]
    assert list(dataset.split("sparse-train").failures()) == expected


def spoil(path, out, change):
    rows = pq.read_table(path)
    content = rows.to_pylist()
    change(content[0])
    pq.write_table(type(rows).from_pylist(content, schema=rows.schema), out)
    return SplitFile(out)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (lambda row: row["goal_pairs"][0]["object_poses"].pop(), "seven numbers"),
        (lambda row: row["goal_pairs"][0].update(goal=[0.0] * 7), "not unit"),
        (lambda row: row["goal_pairs"][0].update(object_poses=[]), "seven numbers"),
        (lambda row: row["objects"].pop(), "not in the scene|one pose for each"),
        (lambda row: row["objects"][0].update(role="large"), "role 'target'"),
        (lambda row: row["objects"][0].update(asset_name="../../escape"), "match pattern"),
        (lambda row: row["relations"][0].update(reference="nobody"), "not in the scene"),
        (lambda row: row.update(goal_pairs=None), "NoneType"),
        (lambda row: row["certificate"].update(max_drift_m=float("nan")), "finite"),
    ],
)
def test_a_row_that_is_no_scene_is_refused(frozen, tmp_path, change, complaint):
    file = spoil(frozen / "sparse-test.parquet", tmp_path / "spoiled.parquet", change)
    with pytest.raises(InvalidFileError, match=complaint):
        file.read(0)


def test_a_scene_that_is_there_twice_is_refused(frozen, tmp_path):
    table = pq.read_table(frozen / "sparse-test.parquet")
    pq.write_table(type(table).from_pylist(table.to_pylist()[:1] * 2, schema=table.schema), tmp_path / "twice.parquet")
    with pytest.raises(InvalidFileError, match="twice"):
        SplitFile(tmp_path / "twice.parquet")
