"""One library and one generated scene set for all tests of scene generation."""

import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.scenegen.generation import generate_scenes, open_for_generation
from clutter6d.scenegen.scene_set import SceneSet
from clutter6d.scenegen.track import find_track
from tests.box_library import make_box_library


@pytest.fixture(scope="session")
def box_library(tmp_path_factory: pytest.TempPathFactory) -> AssetLibrary:
    return make_box_library(tmp_path_factory.mktemp("assets") / "boxes")


@pytest.fixture(scope="session")
def moderate_set(box_library: AssetLibrary, tmp_path_factory: pytest.TempPathFactory) -> SceneSet:
    track = find_track("moderate")
    scene_set = open_for_generation(box_library, track, 0, tmp_path_factory.mktemp("scenes") / "moderate")
    assert len(list(generate_scenes(box_library, track, 0, scene_set, range(2)))) == 2
    return SceneSet.open(scene_set.path)
