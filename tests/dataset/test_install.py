"""A data set that does not carry its assets: they are made from their source, and must be the frozen ones."""

import shutil
from pathlib import Path

import pytest
import trimesh

from clutter6d.assets.cache import CACHE_VARIABLE
from clutter6d.assets.sources.furniture_catalogue import FOLDER_VARIABLE
from clutter6d.dataset.dataset import Dataset
from clutter6d.dataset.freeze import Workshop, freeze
from clutter6d.dataset.install import install
from clutter6d.dataset.manifest import PoolRecipe, Recipe, SplitRecipe
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from tests.assets.mesh_files import catalogue, obj_text
from tests.bad_inputs.harness import run_command

SIZES_CM = {"chest": (30, 20, 12), "box": (14, 8, 6), "brick": (12, 6, 5), "bar": (18, 4, 4), "lamp": (9, 9, 9)}
RECIPE = Recipe(
    name="real-toy",
    title="Boxes that the user installs",
    licence="none",
    ships_assets=False,
    pools={"test": PoolRecipe(source="furniture_catalogue", options={"excluded": {"Test#lamp": "hangs"}})},
    splits=(SplitRecipe(name="sparse-test", track="sparse", pool="test", seed=0, scenes=1),),
)


def write_catalogue(folder: Path, sizes_cm: dict[str, tuple[int, int, int]]) -> Path:
    box = obj_text(trimesh.creation.box((1, 1, 1)))
    models = {
        f"Test#{name}": (f"name={name}\nwidth={x}\ndepth={y}\nheight={z}", box) for name, (x, y, z) in sizes_cm.items()
    }
    return catalogue(folder, models)


@pytest.fixture(scope="module")
def frozen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("real")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(write_catalogue(folder / "package", SIZES_CM)))
        list(freeze(RECIPE, Workshop(folder=folder / "work"), folder / "real-toy"))
    return folder


@pytest.fixture
def dataset(frozen: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dataset:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setenv(FOLDER_VARIABLE, str(frozen / "package" / "share" / "sweethome3d" / "furniture"))
    return Dataset(frozen / "real-toy")


def test_it_carries_no_mesh_but_names_each_with_hash_licence_and_author(dataset: Dataset) -> None:
    assert {path.name for path in dataset.path.iterdir()} == {
        "manifest.json",
        "recipe.json",
        "asset_list.csv",
        "sparse-test.parquet",
    }
    rows = dataset.asset_list
    assert list(rows["name"]) == ["bar", "box", "brick", "chest"]
    assert set(rows["licence"]) == {"CC-BY-3.0"}
    assert (rows["content_hash"].str.len() == 64).all()


def test_before_the_installation_the_message_says_what_to_run(dataset: Dataset) -> None:
    with pytest.raises(MissingFileError, match="clutter6d dataset install real-toy"):
        dataset.split("sparse-test")


def test_installed_assets_are_the_frozen_ones_and_its_scenes_verify(dataset: Dataset) -> None:
    assert [item.problem for item in install(dataset)] == [None] * 4
    outcome = run_command(["dataset", "verify", str(dataset.path), "--physics", "--regenerate", "1"])
    assert (outcome.code, outcome.err) == (0, "")


def test_a_second_installation_makes_nothing_again(dataset: Dataset) -> None:
    list(install(dataset))
    before = {path: path.stat().st_mtime_ns for path in dataset.library_path.rglob("*") if path.is_file()}
    list(install(dataset))
    assert {path: path.stat().st_mtime_ns for path in dataset.library_path.rglob("*") if path.is_file()} == before


def test_an_asset_that_differs_is_named_and_mended_by_another_run(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = write_catalogue(tmp_path / "other", SIZES_CM | {"bar": (19, 4, 4)})
    with monkeypatch.context() as patch:
        patch.setenv(FOLDER_VARIABLE, str(other))
        (wrong,) = (item for item in install(dataset) if item.problem is not None)
        assert wrong.name == "bar"
        assert wrong.content_hash[:12] in str(wrong.problem)
        outcome = run_command(["dataset", "install", str(dataset.path)])
        assert outcome.code == 2
        assert "1 of 4 assets are not the frozen ones, so" in outcome.err
    assert all(item.problem is None for item in install(dataset))
    assert run_command(["dataset", "install", str(dataset.path)]).code == 0


def test_an_object_that_the_catalogue_lacks_is_named(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fewer = {name: size for name, size in SIZES_CM.items() if name != "brick"}
    monkeypatch.setenv(FOLDER_VARIABLE, str(write_catalogue(tmp_path / "other", fewer)))
    problems = [item.problem for item in install(dataset) if item.problem is not None]
    assert problems == [
        "Test#brick is not in the installed furniture_catalogue; install the release that pool test describes"
    ]


def test_where_the_package_is_missing_it_is_named(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path))
    with pytest.raises(MissingFileError, match="apt-get install sweethome3d-furniture"):
        list(install(dataset))
    outcome = run_command(["dataset", "install", str(dataset.path)])
    assert outcome.code == 2
    assert len(outcome.err.splitlines()) == 1


def spoil(dataset: Dataset, tmp_path: Path, **changes: object) -> Dataset:
    shutil.copytree(dataset.path, tmp_path / "spoiled")
    spoiled = Dataset(tmp_path / "spoiled")
    spoiled.manifest = spoiled.manifest.model_copy(update=changes)
    return spoiled


def test_what_carries_its_assets_needs_no_installation(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="nothing to install"):
        list(install(spoil(dataset, tmp_path, ships_assets=True)))


def test_another_version_of_the_processing_is_refused_at_once(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(InvalidValueError, match="version 1 of the asset processing"):
        list(install(spoil(dataset, tmp_path, processing_version=1)))


def test_options_that_the_source_cannot_take_are_a_fault_of_the_manifest(dataset: Dataset, tmp_path: Path) -> None:
    pools = dict(dataset.manifest.pools)
    pools["test"] = pools["test"].model_copy(update={"options": {"max_side_m": "wide"}})
    with pytest.raises(InvalidFileError, match="cannot be given these options"):
        list(install(spoil(dataset, tmp_path, pools=pools)))
