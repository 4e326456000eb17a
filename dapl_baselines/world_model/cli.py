"""The commands ``dapl train world-model`` and ``dapl show-predictions``."""

import sys
from pathlib import Path
from typing import Annotated

import torch
import typer
from rich.console import Console
from rich.markdown import Markdown

from clutter6d import __version__
from clutter6d.errors import InvalidValueError
from clutter6d.progress import progress_bars
from clutter6d.schema import read_model, write_bytes, write_model
from dapl_baselines.interactions.dataset import InteractionData, Transitions, open_interactions
from dapl_baselines.world_model.batches import some_of
from dapl_baselines.world_model.evaluation import ErrorTable, evaluate
from dapl_baselines.world_model.loss import LossConfig
from dapl_baselines.world_model.model import WorldModel, WorldModelConfig
from dapl_baselines.world_model.picture import draw_predictions
from dapl_baselines.world_model.presets import find_preset
from dapl_baselines.world_model.report import DataSummary, Report, to_markdown
from dapl_baselines.world_model.train_config import RunConfig, TrainConfig, find_train_preset
from dapl_baselines.world_model.trained import load_world_model
from dapl_baselines.world_model.trainer import MODEL_FILE, Progress, Trainer

_REPORTED_CLOUDS = 2048

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
    seed: Annotated[int, typer.Option(help="Of initial weights and batches.")] = 0,
    device: Device = "",
) -> None:
    """Train a world model on recorded interactions, and report its errors beside what needs no learning."""
    interactions = open_interactions(data)
    config = RunConfig(
        model=_find_model(model),
        train=_find_training(preset, steps=steps, minutes=max_minutes, rows=rows, seed=seed),
        data_sha256=interactions.sha256,
    )
    trainer = Trainer(interactions, out, config, find_device(device))
    console = Console(markup=False, emoji=False)
    _train(trainer, console)
    report = _report(trainer, interactions, out, config, console)
    write_bytes(out / "report.md", to_markdown(report).encode())
    write_model(out / "report.json", report)
    console.print(Markdown(to_markdown(report)) if sys.stdout.isatty() else to_markdown(report), soft_wrap=True)


def find_device(name: str) -> torch.device:
    """The device of a name; the graphics card, if there is one, for none.

    Raises:
        InvalidValueError: There is no such device here.
    """
    try:
        device = torch.device(name or ("cuda" if torch.cuda.is_available() else "cpu"))
    except RuntimeError:
        raise InvalidValueError(f"device '{name}' is unknown; choose cpu or cuda") from None
    if device.type not in ("cpu", "cuda") or (device.type == "cuda" and not torch.cuda.is_available()):
        raise InvalidValueError(f"there is no device '{name}' here; choose cpu")
    return device


def _find_model(name: str) -> WorldModelConfig:
    if Path(name).suffix == ".json":
        return read_model(Path(name), WorldModelConfig, what="configuration of a world model")
    return find_preset(name)


def _find_training(
    preset: str, *, steps: int | None, minutes: float | None, rows: int | None, seed: int
) -> TrainConfig:
    train = find_train_preset(preset)
    batch = train.batch.model_copy(update={"rows": rows or train.batch.rows})
    return train.model_copy(
        update={"batch": batch, "steps": steps or train.steps, "minutes": minutes or train.minutes, "seed": seed}
    )


def _train(trainer: Trainer, console: Console) -> None:
    with progress_bars(console) as progress:
        bar = progress.add_task("training", total=1000)

        def show(standing: Progress) -> None:
            text = f"step {standing.step:,}, loss {standing.loss:.3g}, best held-out {standing.best_loss:.3g}"
            progress.update(bar, completed=round(1000 * standing.share), description=text)

        trainer.run(show)


def _report(trainer: Trainer, data: InteractionData, out: Path, config: RunConfig, console: Console) -> Report:
    model, checkpoint = load_world_model(out / MODEL_FILE)
    return Report(
        config=config,
        data=DataSummary.of(data),
        parameters=sum(weight.numel() for weight in model.parameters()),
        steps=trainer.step,
        minutes=trainer.seconds / 60,
        best_step=checkpoint.header.history[-1].steps,
        weights_sha256=checkpoint.header.weights_sha256,
        clutter6d=__version__,
        held_out=_errors(model, data, data.validation, config.loss, console, "errors on held-out scenes"),
        trained_on=_errors(model, data, data.training, config.loss, console, "errors on scenes trained on"),
    )


def _errors(
    model: WorldModel,
    data: InteractionData,
    transitions: Transitions,
    loss: LossConfig,
    console: Console,
    what: str,
) -> ErrorTable:
    chosen = some_of(transitions, _REPORTED_CLOUDS)
    with progress_bars(console) as progress:
        bar = progress.add_task(what, total=len(chosen))
        found = evaluate(model, data, chosen, loss=loss, show=lambda done: progress.update(bar, completed=done))
    return found.errors


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
