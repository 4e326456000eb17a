"""The furniture catalogue: names, real sizes, rotations, creators and licences."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.furniture_catalogue import FOLDER_VARIABLE, FurnitureCatalogueSource
from clutter6d.errors import InvalidFileError, MeshRejectedError, MissingFileError
from tests.assets.mesh_files import catalogue, obj_text

WIDE_HIGH_DEEP = obj_text(trimesh.creation.box((3, 2, 1)))
MUG = "name=Caf\\u00e9 mug\nwidth=9\ndepth=3\nheight=6\ncreator=A Potter"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return catalogue(
        tmp_path,
        {
            "Test#mug": (MUG, WIDE_HIGH_DEEP),
            "Test#mug2": (MUG.replace("creator=A Potter", "modelRotation=0 0 1 0 1 0 -1 0 0"), WIDE_HIGH_DEEP),
            "Test#sofa": ("name=Sofa\nwidth=200\ndepth=90\nheight=80", WIDE_HIGH_DEEP),
            "Test#broken": ("name=Broken\nwidth=10\ndepth=10\nheight=10", b"no mesh"),
        },
    )


def test_small_objects_are_listed_with_name_size_and_terms(folder: Path) -> None:
    mug, second, broken = FurnitureCatalogueSource(folder).objects()
    assert (mug.key, mug.name, mug.extents_m) == ("Test#mug", "cafe-mug", (0.09, 0.03, 0.06))
    assert (mug.licence.name, mug.licence.author) == ("CC-BY-3.0", "A Potter")
    assert (second.name, second.licence.author) == ("cafe-mug-2", "2020, somebody")
    assert broken.hints.category == "broken"


def test_the_size_limit_can_be_chosen(folder: Path) -> None:
    assert len(FurnitureCatalogueSource(folder, max_side_m=0.095).objects()) == 2
    assert len(FurnitureCatalogueSource(folder, max_side_m=2.5).objects()) == 4


def test_objects_can_be_left_out_and_the_others_keep_their_names(folder: Path) -> None:
    source = FurnitureCatalogueSource(folder, excluded={"Test#mug": "a reason"})
    assert [item.name for item in source.objects()] == ["cafe-mug-2", "broken"]


def test_models_stand_upright_and_turned(folder: Path) -> None:
    source = FurnitureCatalogueSource(folder)
    upright, turned = (source.load(item).visual[0].mesh.vertices for item in source.objects()[:2])
    np.testing.assert_allclose(np.ptp(upright, axis=0), (3, 1, 2), atol=1e-6)
    np.testing.assert_allclose(np.ptp(turned, axis=0), (1, 3, 2), atol=1e-6)


def test_a_broken_model_is_rejected(folder: Path) -> None:
    source = FurnitureCatalogueSource(folder)
    with pytest.raises(MeshRejectedError, match="empty"):
        source.load(source.objects()[2])


def test_fingerprints_differ_between_models(folder: Path) -> None:
    source = FurnitureCatalogueSource(folder)
    assert len({source.fingerprint(item) for item in source.objects()}) == 3


def test_where_it_is_not_installed_the_message_says_how(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    with pytest.raises(MissingFileError, match="apt-get install sweethome3d-furniture"):
        FurnitureCatalogueSource()


def test_a_catalogue_that_is_no_zip_is_told(tmp_path: Path) -> None:
    (tmp_path / "broken.sh3f").write_bytes(b"not a zip")
    with pytest.raises(InvalidFileError, match="not a furniture catalogue"):
        FurnitureCatalogueSource(tmp_path).objects()


@pytest.mark.real
def test_the_debian_package_lists_311_small_objects_with_licences() -> None:
    items = FurnitureCatalogueSource().objects()
    assert len(items) == 311
    assert {item.licence.name for item in items} == {"CC0-1.0", "CC-BY-3.0", "CC-BY-3.0-US"}
    assert all(item.licence.author for item in items)
    assert len({item.name for item in items}) == 311


@pytest.mark.real
def test_real_mugs_become_assets_at_their_catalogue_size(tmp_path: Path) -> None:
    source = FurnitureCatalogueSource()
    items = [item for item in source.objects() if item.name in ("coffee-mug", "scissors", "pencil", "hammer", "bread")]
    library = AssetLibrary.create(tmp_path / "library", settings_as_stored(ProcessingSettings()))
    list(run(source, items, library, ProcessingSettings(), RunSettings()))
    for item in items:
        assert library.describe(item.name).extents_m == pytest.approx(item.extents_m, rel=0.01, abs=2e-4)
    assert library.verify() == ()
