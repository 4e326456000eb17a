"""The command ``clutter6d dataset install``."""

from typing import Annotated

import typer
from rich.console import Console

from clutter6d.dataset.dataset import open_dataset
from clutter6d.dataset.install import Installed, unusable_scenes
from clutter6d.dataset.install import install as install_assets
from clutter6d.errors import InvalidFileError
from clutter6d.progress import progress_bars


def install(
    name: Annotated[str, typer.Argument(help="A data set that does not carry its assets.")],
    workers: Annotated[int, typer.Option(min=1, help="Worker processes.")] = 1,
) -> None:
    """Make the assets that a data set names from their source, and compare each with its frozen hash."""
    dataset, console = open_dataset(name), Console(markup=False, emoji=False)
    wrong: list[Installed] = []
    with progress_bars(console) as progress:
        bar = progress.add_task(f"assets of {dataset.name}", total=len(dataset.asset_list))
        for item in install_assets(dataset, workers=workers):
            progress.advance(bar)
            if item.problem is not None:
                wrong.append(item)
                progress.console.print(item.problem, markup=False, highlight=False, soft_wrap=True)
    if wrong:
        lost = f"{len(wrong)} of {len(dataset.asset_list)} assets are not the frozen ones"
        advice = "install the versions of constraints.txt and run this again"
        problem = f"{lost}, so {unusable_scenes(dataset, wrong)} scenes cannot be used here; {advice}"
        raise InvalidFileError(dataset.library_path, problem)
    console.print(f"{dataset.name}: {len(dataset.asset_list)} assets in {dataset.library_path}", soft_wrap=True)
