"""The commands ``clutter6d dataset info | verify | freeze | card | compare | install | recipe``."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Column, Table

from clutter6d.dataset.card_cli import card, compare
from clutter6d.dataset.dataset import DEFAULT_DATASET, Dataset, dataset_names, open_dataset
from clutter6d.dataset.freeze import Workshop, freeze
from clutter6d.dataset.install_cli import install
from clutter6d.dataset.list_recipe import write_recipe
from clutter6d.dataset.manifest import Recipe
from clutter6d.dataset.split import Split
from clutter6d.dataset.verify import (
    Finding,
    check_engine,
    choose_scenes,
    verify_assets,
    verify_files,
    verify_in_processes,
    verify_pools,
    verify_scenes,
    verify_sources,
)
from clutter6d.errors import InvalidFileError, InvalidValueError
from clutter6d.executor import EXECUTOR_HELP, Executor, parse_executor
from clutter6d.progress import BarsByName, progress_bars
from clutter6d.schema import read_model

app = typer.Typer(no_args_is_help=True, help="Frozen data sets: look at them, check them, make them, compare them.")
app.command()(card)
app.command()(compare)
app.command()(install)
app.command("recipe")(write_recipe)

Name = Annotated[str, typer.Argument(help="A data set's name or folder.")]
Workers = Annotated[int, typer.Option(min=1, help="Worker processes.")]
ExecutorOption = Annotated[str, typer.Option("--executor", help=EXECUTOR_HELP)]


@app.command()
def info(
    name: Annotated[str | None, typer.Argument(help="A data set's name or folder; all if left out.")] = None,
) -> None:
    """Say what a data set holds."""
    console = Console(markup=False, emoji=False)
    for dataset in [open_dataset(name)] if name else [open_dataset(each) for each in dataset_names()]:
        _print_info(dataset, console)


@app.command()
def verify(
    name: Name = DEFAULT_DATASET,
    physics: Annotated[bool, typer.Option("--physics", help="Check every certificate in the simulator.")] = False,
    regenerate: Annotated[
        int, typer.Option(min=0, help="Make so many assets of each pool and scenes of each split from their seeds.")
    ] = 0,
    split: Annotated[list[str] | None, typer.Option(help="Only this split; may be given again.")] = None,
    workers: Workers = 1,
    executor: ExecutorOption = "local",
) -> None:
    """Check every hash; on request every certificate, and that seeds give the same scenes. Exit code 2 if not."""
    dataset, where, console = open_dataset(name), parse_executor(executor), Console(markup=False, emoji=False)
    check = _Check(dataset, split or list(dataset.split_names), workers, where)
    if regenerate:
        check_engine(dataset)
    with progress_bars(console) as progress:
        check.run(progress, physics=physics, regenerate=regenerate)
    if check.problems:
        raise InvalidFileError(dataset.path, f"{len(check.problems)} problems found, listed above")
    console.print(f"{dataset.name}: {', '.join(check.done)} verified")


@app.command("freeze")
def freeze_command(
    recipe: Annotated[Path, typer.Argument(help="A recipe.json.")],
    work: Annotated[Path, typer.Option(help="Folder of what is made on the way; an unfinished one is continued.")],
    out: Annotated[Path | None, typer.Option(help="The data set's folder; by default the recipe's.")] = None,
    pool: Annotated[
        list[str] | None, typer.Option(help="POOL=LIBRARY: take a pool's assets from a library; may be given again.")
    ] = None,
    workers: Workers = 1,
    executor: ExecutorOption = "local",
) -> None:
    """Make a data set from its recipe: assets, scenes, and the files with their hashes."""
    console = Console(markup=False, emoji=False)
    made = read_model(recipe, Recipe, what="recipe")
    workshop = Workshop(
        folder=work, libraries=_parse_pools(pool or []), workers=workers, executor=parse_executor(executor)
    )
    folder = out or recipe.parent
    with progress_bars(console) as progress:
        bars = BarsByName(progress)
        for step in freeze(made, workshop, folder):
            bars.update(*step)
    _print_info(Dataset(folder), console)


class _Check:
    """The steps of ``verify``, each with a progress bar."""

    def __init__(self, dataset: Dataset, splits: list[str], workers: int, executor: Executor) -> None:
        self._dataset, self._workers, self._executor = dataset, workers, executor
        self._splits = [dataset.split(name) for name in splits]
        self.problems: list[str] = []
        self.done: list[str] = []

    def run(self, progress: Progress, *, physics: bool, regenerate: int) -> None:
        """Do all steps."""
        dataset = self._dataset
        self._step(progress, "files", verify_files(dataset), len(dataset.manifest.files) + 1)
        self._step(progress, "pools", verify_pools(dataset), len(dataset.manifest.pools) + 1)
        self._step(progress, "assets", verify_assets(dataset), len(dataset.asset_list))
        if regenerate and dataset.manifest.ships_assets:
            count = regenerate * len(dataset.manifest.pools)
            self._step(progress, "sources of assets", verify_sources(dataset, regenerate), count)
        for split in self._splits:
            rows = dataset.asset_list
            pool = frozenset(rows["name"][rows["pool"] == split.entry.pool])
            self._step(progress, f"scenes of {split.name}", verify_scenes(split, pool), len(split) + 1)
        for split in self._splits if physics else ():
            self._simulate(progress, f"certificates of {split.name}", split, split.scene_ids)
        for split in self._splits if regenerate else ():
            chosen = choose_scenes(split, regenerate)
            self._simulate(progress, f"seeds of {split.name}", split, chosen, regenerate=True)

    def _simulate(
        self, progress: Progress, what: str, split: Split, chosen: tuple[str, ...], *, regenerate: bool = False
    ) -> None:
        found = verify_in_processes(
            self._dataset,
            split,
            chosen,
            regenerate=regenerate,
            workers=self._workers,
            executor=self._executor,
        )
        self._step(progress, what, found, len(chosen))

    def _step(self, progress: Progress, what: str, findings: Iterable[Finding], total: int) -> None:
        bar = progress.add_task(what, total=total)
        for finding in findings:
            progress.advance(bar)
            for problem in finding.problems:
                self.problems.append(problem)
                progress.console.print(problem, markup=False, highlight=False, soft_wrap=True)
        self.done.append(what)


def _print_info(dataset: Dataset, console: Console) -> None:
    manifest = dataset.manifest
    console.print(f"{manifest.name}: {manifest.title}")
    console.print(f"in {dataset.path}; {manifest.licence}; {manifest.engine}, generator {manifest.generator_version}")
    table = Table("split", "track", "assets", "scenes", "goal pairs", Column("SHA-256", overflow="fold"))
    for split in manifest.splits:
        table.add_row(
            split.name, split.track, split.pool, f"{split.scenes:,}", f"{split.pairs:,}", split.scenes_sha256[:16]
        )
    console.print(table)
    pools = Table("asset pool", "assets", "from", Column("SHA-256", overflow="fold"))
    for name, pool in manifest.pools.items():
        pools.add_row(name, f"{pool.assets:,}", pool.description or pool.source, pool.sha256[:16])
    console.print(pools)


def _parse_pools(given: list[str]) -> dict[str, Path]:
    pools: dict[str, Path] = {}
    for item in given:
        name, sign, folder = item.partition("=")
        if not sign or not name or not folder:
            raise InvalidValueError(f"--pool {item}: expected POOL=LIBRARY")
        pools[name] = Path(folder)
    return pools
