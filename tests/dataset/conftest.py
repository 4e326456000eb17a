"""A small frozen data set of boxes, made once by the code that makes the real ones."""

from pathlib import Path

import pytest

from clutter6d.dataset.dataset import Dataset
from clutter6d.dataset.freeze import Workshop, freeze
from clutter6d.dataset.manifest import PoolRecipe, Recipe, SplitRecipe
from tests.box_library import make_box_library

RECIPE = Recipe(
    name="boxes-v1",
    title="Boxes",
    licence="Apache-2.0",
    ships_assets=True,
    pools={"train": PoolRecipe(source="procedural"), "test": PoolRecipe(source="procedural")},
    splits=(
        SplitRecipe(name="sparse-train", track="sparse", pool="train", seed=1, scenes=3),
        SplitRecipe(name="sparse-test", track="sparse", pool="test", seed=2, scenes=2),
    ),
)


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Workshop:
    """What the data set is made from, and in."""
    folder = tmp_path_factory.mktemp("workshop")
    libraries = {"train": folder / "train-library", "test": folder / "test-library"}
    make_box_library(libraries["train"], large=2, small=4)
    make_box_library(libraries["test"], large=3, small=4, name="test-box")
    return Workshop(folder=folder, libraries=libraries)


@pytest.fixture(scope="session")
def frozen(workshop: Workshop, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the data set; not to be changed."""
    out = tmp_path_factory.mktemp("datasets") / "boxes-v1"
    list(freeze(RECIPE, workshop, out))
    return out


@pytest.fixture
def dataset(frozen: Path) -> Dataset:
    """The data set, opened anew."""
    return Dataset(frozen)
