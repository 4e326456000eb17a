"""The report of a training that is over, in its folder: how its best model does beside what needs no learning."""

from pathlib import Path
from typing import Final

from clutter6d import __version__
from clutter6d.schema import write_bytes, write_model
from dapl_baselines.interactions.dataset import InteractionData, Transitions
from dapl_baselines.validation_run import Observer, ignore
from dapl_baselines.world_model.batches import some_of
from dapl_baselines.world_model.evaluation import ErrorTable, evaluate
from dapl_baselines.world_model.report import DataSummary, Report, to_markdown
from dapl_baselines.world_model.trained import load_world_model
from dapl_baselines.world_model.trainer import MODEL_FILE, Trainer

REPORT_FILE, PAGE_FILE = "report.json", "report.md"
HELD_OUT_CLOUDS: Final = 2048
"""Transitions that the errors on held-out scenes are means over."""
TRAINED_ON_CLOUDS: Final = 512
"""The same of scenes trained on."""


def write_report(trainer: Trainer, data: InteractionData, out: Path, observe: Observer = ignore) -> Report:
    """Find the errors of the best model, and write them.

    Args:
        trainer: The training, which is over.
        data: What it was trained on.
        out: Its folder.
        observe: Told of the transitions, as they are looked at.

    Raises:
        InvalidFileError: The checkpoint is damaged.
        StorageError: The report cannot be written.
    """
    model, checkpoint = load_world_model(out / MODEL_FILE)
    model.to(trainer.device)

    def errors(what: str, transitions: Transitions) -> ErrorTable:
        def show(done: int) -> None:
            observe(f"errors on {what}", done, len(transitions))

        return evaluate(model, data, transitions, loss=trainer.config.loss, show=show).errors

    report = Report(
        config=trainer.config,
        data=DataSummary.of(data),
        parameters=sum(weight.numel() for weight in model.parameters()),
        steps=trainer.step,
        minutes=trainer.seconds / 60,
        best_step=checkpoint.header.history[-1].steps,
        weights_sha256=checkpoint.header.weights_sha256,
        clutter6d=__version__,
        held_out=errors("held-out scenes", some_of(data.validation, HELD_OUT_CLOUDS)),
        trained_on=errors("scenes trained on", some_of(data.training, TRAINED_ON_CLOUDS)),
    )
    write_bytes(out / PAGE_FILE, to_markdown(report).encode())
    write_model(out / REPORT_FILE, report)
    return report
