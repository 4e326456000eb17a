"""The commands ``dapl train world-model`` and ``dapl show-predictions``."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markdown import Markdown

from clutter6d.progress import BarsByName, progress_bars
from clutter6d.schema import write_bytes
from dapl_baselines.devices import find_device
from dapl_baselines.interactions.dataset import open_interactions
from dapl_baselines.preset_choices import with_choices
from dapl_baselines.world_model.final_report import write_report
from dapl_baselines.world_model.picture import draw_predictions
from dapl_baselines.world_model.presets import find_model
from dapl_baselines.world_model.report import to_markdown
from dapl_baselines.world_model.train_config import RunConfig, find_train_preset
from dapl_baselines.world_model.trained import load_world_model
from dapl_baselines.world_model.trainer import Progress, Trainer

Data = Annotated[list[Path], typer.Option(help="What dapl record wrote; may be given more than once.")]
Device = Annotated[str, typer.Option(help="cpu or cuda; by default cuda where there is one.")]


def train_world_model(
    data: Data,
    out: Annotated[Path, typer.Option(help="Folder of the training; an unfinished one goes on.")],
    preset: Annotated[str, typer.Option(help="laptop (an hour on two cores) or paper.")] = "laptop",
    model: Annotated[
        str,
        typer.Option(
            help="points (DAPL's), points-xyz-velocity, points-xyz, object, object-xyz, reconstruction, "
            "reconstruction-xyz, or a JSON file of a configuration."
        ),
    ] = "points",
    steps: Annotated[int | None, typer.Option(min=1, help="Optimiser steps at most; default the preset's.")] = None,
    max_minutes: Annotated[float | None, typer.Option(min=0.01, help="Minutes at most; default the preset's.")] = None,
    rows: Annotated[int | None, typer.Option(min=1, help="Transitions of a batch; default the preset's.")] = None,
    variance_weight: Annotated[
        float | None,
        typer.Option(min=0, help="Weight of the loss that compares how much velocities vary; default the preset's."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of initial weights and batches.")] = 0,
    device: Device = "",
) -> None:
    """Train a world model on recorded interactions, and report its errors beside what needs no learning."""
    interactions, chosen = open_interactions(data), find_train_preset(preset)
    batch = with_choices(chosen.train.batch, rows=rows)
    config = RunConfig(
        model=find_model(model),
        loss=with_choices(chosen.loss, variance_weight=variance_weight),
        train=with_choices(chosen.train, steps=steps, minutes=max_minutes, seed=seed, batch=batch),
        data_sha256=interactions.sha256,
    )
    trainer = Trainer(interactions, out, config, find_device(device))
    console = Console(markup=False, emoji=False)
    _train(trainer, console)
    with progress_bars(console) as progress:
        report = write_report(trainer, interactions, out, BarsByName(progress).update)
    console.print(Markdown(to_markdown(report)) if sys.stdout.isatty() else to_markdown(report), soft_wrap=True)


def _train(trainer: Trainer, console: Console) -> None:
    with progress_bars(console) as progress:
        bar = progress.add_task("training", total=1000)

        def show(standing: Progress) -> None:
            text = f"step {standing.step:,}, loss {standing.loss:.3g}, best held-out {standing.best_loss:.3g}"
            progress.update(bar, completed=round(1000 * standing.share), description=text)

        trainer.run(show)


def show_predictions(
    data: Data,
    model: Annotated[Path, typer.Option(help="Checkpoint of a world model, world-model.pt.")],
    out: Annotated[Path, typer.Option(help="The picture.")] = Path("predictions.png"),
    count: Annotated[int, typer.Option(min=1, max=12, help="Transitions, one a row.")] = 4,
    seed: Annotated[int, typer.Option(help="Of the choice of transitions.")] = 0,
) -> None:
    """Draw predicted against true motion of held-out scenes, as the paper's figure does."""
    trained, _ = load_world_model(model)
    write_bytes(out, draw_predictions(trained, open_interactions(data), count, seed))
    print(f"drawn to {out}")
