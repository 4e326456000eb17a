"""Freezing is resumable, gives the same bytes again, and never writes over a frozen data set."""

from dataclasses import replace

import pytest

from clutter6d.dataset.freeze import Workshop, check_recipe, freeze
from clutter6d.dataset.manifest import PoolRecipe
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.scenegen.scene_set import SceneSet
from tests.dataset.conftest import RECIPE


def test_the_same_recipe_gives_the_same_bytes(frozen, workshop, tmp_path):
    fresh = replace(workshop, folder=tmp_path / "work")
    list(freeze(RECIPE, fresh, tmp_path / "again"))
    names = sorted(path.name for path in frozen.iterdir())
    assert sorted(path.name for path in (tmp_path / "again").iterdir()) == names
    for name in names:
        assert (tmp_path / "again" / name).read_bytes() == (frozen / name).read_bytes(), name


def test_it_goes_on_where_it_was_stopped(frozen, workshop, tmp_path):
    fresh, out = replace(workshop, folder=tmp_path / "work"), tmp_path / "out"
    for what, done, _ in freeze(RECIPE, fresh, out):
        if what == "scenes of sparse-train" and done == 2:
            break
    kept = {path: path.stat().st_mtime_ns for path in fresh.split_path("sparse-train").glob("scenes/*/scene.json")}
    assert len(kept) == 2
    list(freeze(RECIPE, fresh, out))
    assert all(path.stat().st_mtime_ns == time for path, time in kept.items())
    assert (out / "manifest.json").read_bytes() == (frozen / "manifest.json").read_bytes()


def test_a_frozen_data_set_is_never_written_over(frozen, workshop):
    before = {path.name: path.read_bytes() for path in frozen.iterdir()}
    with pytest.raises(InvalidValueError, match="new version"):
        list(freeze(RECIPE, workshop, frozen))
    assert {path.name: path.read_bytes() for path in frozen.iterdir()} == before


def test_a_pool_is_made_from_its_source(tmp_path):
    recipe = RECIPE.model_copy(
        update={"pools": {"train": PoolRecipe(source="procedural", options={"seed": 3, "count": 2})}, "splits": ()}
    )
    steps = list(freeze(recipe, Workshop(folder=tmp_path / "work"), tmp_path / "out"))
    assert ("assets of pool train", 2, 2) in steps


@pytest.mark.parametrize(
    ("split", "error"),
    [
        ({"pool": "none"}, InvalidValueError),
        ({"track": "crowded"}, UnknownNameError),
        ({"name": "sparse-test"}, InvalidValueError),
    ],
)
def test_a_recipe_that_does_not_fit_is_refused_before_any_work(split, error):
    wrong = RECIPE.splits[0].model_copy(update=split)
    with pytest.raises(error):
        check_recipe(RECIPE.model_copy(update={"splits": (wrong, RECIPE.splits[1])}))


def test_more_scenes_than_the_recipe_asks_for_are_refused(workshop, tmp_path):
    fewer = RECIPE.model_copy(update={"splits": (RECIPE.splits[0].model_copy(update={"scenes": 1}),)})
    assert len(SceneSet.open(workshop.split_path("sparse-train")).scenes) == 3
    with pytest.raises(InvalidValueError, match="3 scenes, the recipe asks for 1"):
        list(freeze(fewer, workshop, tmp_path / "out"))
