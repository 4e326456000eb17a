"""A curated list becomes a recipe whose pool is exactly the list."""

import json
from pathlib import Path

import pytest

from clutter6d.assets.sources.objaverse import ObjaverseSource
from clutter6d.assets.sources.objaverse_list import ListedObject, read_list, write_list
from clutter6d.dataset.manifest import Recipe
from clutter6d.schema import read_model
from tests.assets.sources.test_objaverse import LocalObjaverse
from tests.bad_inputs.harness import check_refusal, run_command

OBJECTS = tuple(
    ListedObject(
        uid=f"{number:032x}",
        category="mug",
        licence=("CC0-1.0", "CC-BY-4.0")[number % 2],
        author=f"Maker {number}",
        url="https://sketchfab.com/x",
        title="A title that the recipe does not need",
        size_class="small",
        longest_cm=12.5,
    )
    for number in range(3)
)


@pytest.fixture
def listed(tmp_path: Path) -> Path:
    write_list(tmp_path / "list.csv", OBJECTS)
    return tmp_path / "list.csv"


def test_a_list_reads_as_it_was_written(listed: Path) -> None:
    assert read_list(listed) == OBJECTS


def test_the_recipes_pool_is_the_list(listed: Path, tmp_path: Path) -> None:
    outcome = run_command(["dataset", "recipe", str(listed), "--name", "toys-v1", "--out", str(tmp_path / "set")])
    assert (outcome.code, outcome.err) == (0, "")
    made = read_model(tmp_path / "set" / "recipe.json", Recipe, what="recipe")
    assert [(split.name, split.scenes) for split in made.splits] == [
        ("sparse-test", 128),
        ("moderate-test", 128),
        ("dense-test", 128),
    ]
    assert not made.ships_assets
    assert "CC-BY-4.0, CC0-1.0" in made.licence
    package = LocalObjaverse(tmp_path)
    frozen = ObjaverseSource(**made.pools["test"].options, downloader=package)
    curated = ObjaverseSource(list_file=listed, downloader=package)
    assert frozen.objects() == curated.objects()
    assert [frozen.fingerprint(item) for item in frozen.objects()] == [
        curated.fingerprint(item) for item in curated.objects()
    ]


def test_mistakes_are_told_in_one_line(listed: Path, tmp_path: Path) -> None:
    out = str(tmp_path / "set")
    wrong = run_command(["dataset", "recipe", str(listed), "--name", "My Set", "--out", out])
    check_refusal(wrong, 2, ["--name My Set", "small letters"])
    missing = run_command(["dataset", "recipe", str(tmp_path / "none.csv"), "--name", "a", "--out", out])
    check_refusal(missing, 2, ["curated list", "none.csv"])
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "recipe.json").write_text(json.dumps({}))
    there = run_command(["dataset", "recipe", str(listed), "--name", "a", "--out", out])
    check_refusal(there, 2, ["is there already"])
