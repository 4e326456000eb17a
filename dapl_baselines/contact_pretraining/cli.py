"""The command ``dapl train corn``."""

from contextlib import closing
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.progress import progress_bars
from dapl_baselines.contact_pretraining.contact_errors import ContactErrors
from dapl_baselines.contact_pretraining.settings import PRESETS
from dapl_baselines.contact_pretraining.training import MODEL_FILE, ContactTraining
from dapl_baselines.preset_choices import find_preset, with_choices
from dapl_baselines.training_report import until
from dapl_baselines.validation import open_training_scenes


def train_corn(
    preset: Annotated[str, typer.Option(help=f"{', '.join(PRESETS)}.")] = "laptop",
    split: Annotated[
        str, typer.Option(help="A frozen training split or a folder of scenes, whose objects are touched.")
    ] = "sparse-train",
    out: Annotated[Path, typer.Option(help="Folder; a training that was left goes on.")] = Path("trainings/corn"),
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of the optimiser; default the preset's.")] = None,
    batch: Annotated[int | None, typer.Option(min=1, help="Examples of a step; default the preset's.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything drawn.")] = 0,
    max_minutes: Annotated[
        float | None, typer.Option(min=0, help="Stop after so long; the same command goes on.")
    ] = None,
) -> None:
    """Pretrain CORN's encoder to tell which patches of an object the hand touches; no simulation is needed."""
    settings = with_choices(find_preset(PRESETS, preset), steps=steps, batch=batch, seed=seed)
    scenes, console = open_training_scenes(split).training, Console(markup=False, emoji=False)
    assets = {asset.content_hash: asset for scene in scenes.scenes for asset in scenes.assets_of(scene).values()}
    training = ContactTraining(tuple(assets.values()), scenes.sha256, settings, out)
    with progress_bars(console) as progress, closing(training.run()) as reports:
        bar = progress.add_task("training", total=settings.steps, completed=training.step)
        for report in until(reports, max_minutes):
            progress.update(bar, completed=report.step, description=f"training: {report.loss:.4f} nats a patch")
            if report.errors is not None:
                progress.console.print(f"step {report.step:,}: {_describe(report.errors)}", highlight=False)
    best = "" if training.best is None else f"; the best model is {out / MODEL_FILE}"
    console.print(f"{training.step:,} of {settings.steps:,} steps are made{best}", highlight=False)


def _describe(errors: ContactErrors) -> str:
    return (
        f"{errors.loss:.4f} nats a patch of held-out objects ({errors.floor:.4f} without looking); of the patches said "
        f"to be touched {errors.precision:.0%} are, of those touched {errors.recall:.0%} are found"
    )
