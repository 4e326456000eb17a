"""From a curated list of Objaverse's objects to the recipe of a data set that names them, and does not carry them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.assets.sources.objaverse_list import ListedObject, read_list
from clutter6d.dataset.freeze import RECIPE_FILE
from clutter6d.dataset.manifest import PoolRecipe, Recipe, SplitRecipe
from clutter6d.errors import InvalidValueError
from clutter6d.scenegen.track import TRACKS
from clutter6d.schema import write_model

KEPT = {"uid", "category", "licence", "author", "url"}
"""What an asset depends on, or owes its author."""


def make_recipe(objects: Sequence[ListedObject], *, name: str, scenes: int, seed: int) -> Recipe:
    """Test splits of all tracks over the objects of a list.

    Raises:
        InvalidValueError: The name is not one of a data set.
    """
    listed = [item.model_dump(include=KEPT) for item in objects]
    licences = ", ".join(sorted({item.licence for item in objects}))
    try:
        return Recipe(
            name=name,
            title=f"Test splits over {len(objects)} objects of Objaverse, which the user installs",
            licence=f"the scenes: Apache-2.0; the meshes: {licences}, see asset_list.csv",
            ships_assets=False,
            pools={"test": PoolRecipe(source="objaverse", options={"listed": listed}, description="a curated list")},
            splits=tuple(
                SplitRecipe(name=f"{track}-test", track=track, pool="test", seed=seed, scenes=scenes)
                for track in TRACKS
            ),
        )
    except ValueError:
        raise InvalidValueError(f"--name {name}: small letters, digits, dots and hyphens, at most 64") from None


def write_recipe(
    list_file: Annotated[Path, typer.Argument(help="A list made by clutter6d assets curate.")],
    name: Annotated[str, typer.Option(help="Of the data set, with its version, for instance objaverse-v1.")],
    out: Annotated[Path, typer.Option(help="The data set's folder.")],
    scenes: Annotated[int, typer.Option(min=1, help="Scenes of each split.")] = 128,
    seed: Annotated[int, typer.Option(help="Of the scenes.")] = 0,
) -> None:
    """Write the recipe of a data set over the objects of a curated list."""
    made = make_recipe(read_list(list_file), name=name, scenes=scenes, seed=seed)
    if (out / RECIPE_FILE).exists():
        raise InvalidValueError(f"{out / RECIPE_FILE} is there already; remove it, or choose another --out")
    write_model(out / RECIPE_FILE, made)
    console = Console(markup=False, emoji=False)
    console.print(f"next: clutter6d dataset freeze {out / RECIPE_FILE} --work WORK --workers 8", soft_wrap=True)
