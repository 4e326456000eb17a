"""Scene sets: whole after any interruption, and refusing what does not belong."""

import shutil
from pathlib import Path

import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import find_track


def copy_of(scene_set: SceneSet, tmp_path: Path) -> SceneSet:
    shutil.copytree(scene_set.path, tmp_path / "copy")
    return SceneSet.open(tmp_path / "copy")


def test_a_moved_set_is_the_same_set_and_carries_its_assets(moderate_set: SceneSet, tmp_path: Path) -> None:
    moved = copy_of(moderate_set, tmp_path)
    assert moved.sha256 == moderate_set.sha256
    for scene in moved.scenes:
        assert set(moved.assets_of(scene)) == {item.asset_hash for item in scene.objects}


def test_only_what_is_missing_is_generated_again(
    box_library: AssetLibrary, moderate_set: SceneSet, tmp_path: Path
) -> None:
    copy = copy_of(moderate_set, tmp_path)
    (copy.scene_folder("moderate-0-00001") / "scene.json").unlink()
    track = find_track("moderate")
    continued = open_for_generation(box_library, track, 0, copy.path)
    assert list(generate_scenes(box_library, track, 0, continued, range(2))) == ["moderate-0-00001"]
    assert SceneSet.open(copy.path).sha256 == moderate_set.sha256


def test_a_set_of_another_seed_is_not_continued(
    box_library: AssetLibrary, moderate_set: SceneSet, tmp_path: Path
) -> None:
    copy = copy_of(moderate_set, tmp_path)
    with pytest.raises(InvalidValueError, match="scenes of another seed"):
        open_for_generation(box_library, find_track("moderate"), 7, copy.path)


def test_a_folder_of_something_else_is_left_alone(box_library: AssetLibrary, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InvalidValueError, match="neither empty nor a scene set"):
        open_for_generation(box_library, find_track("sparse"), 0, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_missing_set_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"scene set not found.*clutter6d generate"):
        SceneSet.open(tmp_path / "nowhere")


def test_a_scene_with_a_missing_asset_is_refused(moderate_set: SceneSet, tmp_path: Path) -> None:
    copy = copy_of(moderate_set, tmp_path)
    scene = copy.scenes[0]
    for folder in (copy.path / "library" / "assets").glob(f"*{scene.target.asset_hash[:12]}"):
        shutil.rmtree(folder)
    with pytest.raises(InvalidFileError, match=f"{scene.scene_id}: asset {scene.target.asset_name}.*is missing"):
        copy.assets_of(scene)


def test_a_scene_out_of_place_is_refused(moderate_set: SceneSet, tmp_path: Path) -> None:
    copy = copy_of(moderate_set, tmp_path)
    (copy.path / "scenes" / "moderate-0-00000").rename(copy.path / "scenes" / "moderate-0-00009")
    with pytest.raises(InvalidFileError, match="out of place"):
        _ = SceneSet.open(copy.path).scenes
