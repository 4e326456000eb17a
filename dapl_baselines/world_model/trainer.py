"""Training of a world model, in a folder; a killed training goes on and ends as if it had not been killed.

config.json       what the result depends on
training.pt       weights, optimiser, random state and step, to go on from
world-model.pt    the checkpoint with the lowest loss on the scenes that are held out
losses.csv, validation.csv, tensorboard/   curves
"""

import time
from collections.abc import Callable, Iterable
from contextlib import closing
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch

from dapl_baselines.checkpoint import Checkpoint, write_checkpoint
from dapl_baselines.curves import Curves
from dapl_baselines.interactions.dataset import InteractionData
from dapl_baselines.prefetching import prefetched
from dapl_baselines.run_folder import claim
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_state import take_up
from dapl_baselines.world_model.batches import Batch, some_of, training_batch
from dapl_baselines.world_model.evaluation import evaluate
from dapl_baselines.world_model.learner import Learner
from dapl_baselines.world_model.lineage import begun_with, training_record
from dapl_baselines.world_model.train_config import RunConfig

CONFIG_FILE: Final = "config.json"
STATE_FILE: Final = "training.pt"
MODEL_FILE: Final = "world-model.pt"
ARCHITECTURE: Final = "world-model"


@dataclass(frozen=True, kw_only=True, slots=True)
class Progress:
    """How a training stands.

    Attributes:
        step: Steps made.
        share: How much of it is done, in [0, 1].
        loss: Of the last steps.
        best_loss: The lowest on the scenes that are held out, so far.
    """

    step: int
    share: float
    loss: float
    best_loss: float


class Trainer:
    """A training in a folder, new or gone on with.

    Args:
        data: Transitions to train on, and to watch it on.
        out: The folder.
        config: What the result depends on; the hash of the weights it begins with is filled in from ``start``.
        device: Where it runs.
        start: A trained world model to begin with (paper, "Curriculum Learning"); ``None``: random weights.

    Raises:
        InvalidValueError: The folder is of another training or of something else, or ``start`` is another model.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.

    Attributes:
        config: What the result depends on.
        device: Where it runs.
        step: Steps made.
        seconds: Time they took.
    """

    def __init__(
        self, data: InteractionData, out: Path, config: RunConfig, device: torch.device, start: Checkpoint | None = None
    ) -> None:
        self.config = config if start is None else begun_with(start, config)
        self._data, self._out, self.device = data, out, device
        self._train, self._history = config.train, () if start is None else start.header.history
        claim(out / CONFIG_FILE, self.config, what="world-model training")
        self._learner = Learner(config, device)
        if start is not None:
            self._learner.model.load_state_dict(start.module.state_dict())
        self._watched = some_of(data.validation, self._train.validation_clouds)
        self.step, self.seconds, self._best_loss, self._best_step = 0, 0.0, float("inf"), 0
        self._state: dict[str, object] | None = None
        if (out / STATE_FILE).is_file():
            take_up(out / STATE_FILE, self._restore)

    @property
    def is_over(self) -> bool:
        """Whether a limit is reached, or the loss on held-out scenes has not fallen for too long."""
        is_stale = self.step - self._best_step >= self._train.patience * self._train.validate_every
        return is_stale or self._train.progress(self.step, self.seconds) >= 1

    def run(self, show: Callable[[Progress], None] | None = None) -> None:
        """Train to the end; interrupted, or ended by an error, it loses the steps since the last row of the loss curve.

        Args:
            show: Told now and then how it stands.

        Raises:
            DivergedError: The loss is not finite any more.
        """
        if self.is_over:
            return
        batches = prefetched(self._draw, range(self.step, self._train.steps))
        with closing(Curves(self._out, self.step, counted="step")) as curves, closing(batches):
            try:
                self._make_steps(batches, curves, show)
            finally:
                self._save()

    def _make_steps(
        self, batches: Iterable[Batch], curves: Curves, show: Callable[[Progress], None] | None = None
    ) -> None:
        recent, started = list[dict[str, float]](), time.monotonic()
        for batch in batches:
            rate = self._train.learning_rate_at(self.step, self.seconds)
            recent.append({**self._learner.make_step(batch.to(self.device), rate), "learning_rate": rate})
            self.step += 1
            self.seconds, started = self.seconds + time.monotonic() - started, time.monotonic()
            if self.step % self._train.log_every == 0:
                progress, recent = self._log(curves, recent), []
                if show is not None:
                    show(progress)
            if self.is_over or self.step % self._train.validate_every == 0:
                self._look(curves)
            if self.is_over or self.step % self._train.log_every == 0:
                self._state = self._copy_state()
            if self.is_over or self.step % self._train.save_every == 0:
                self._save()
            if self.is_over:
                break

    def _draw(self, step: int) -> Batch:
        return training_batch(self._data, step, self._train.batch, self._train.seed)

    def _log(self, curves: Curves, recent: list[dict[str, float]]) -> Progress:
        means = {name: sum(values[name] for values in recent) / len(recent) for name in recent[0]}
        curves.add("losses", self.step, {**means, "seconds": round(self.seconds, 1)})
        share = self._train.progress(self.step, self.seconds)
        return Progress(step=self.step, share=share, loss=means["loss"], best_loss=self._best_loss)

    def _look(self, curves: Curves) -> None:
        """Look at the scenes that are held out, and keep the model if it never was better."""
        found = evaluate(
            self._learner.model,
            self._data,
            self._watched,
            loss=self.config.loss,
            sets=("moving_objects",),
            predictors=("model",),
        )
        moving = found.errors["moving_objects"]["model"]
        values = {"loss": found.loss, "dynamics_loss": found.dynamics_loss}
        errors = {"chamfer_cm": moving.chamfer_cm, "distance_cm": moving.distance_cm}
        curves.add("validation", self.step, {**values, **errors})
        if found.dynamics_loss < self._best_loss:
            self._best_loss, self._best_step = found.dynamics_loss, self.step
            write_checkpoint(
                self._out / MODEL_FILE,
                architecture=ARCHITECTURE,
                config=self.config.model,
                module=self._learner.model,
                precision=self._train.stored_precision,
                history=(*self._history, training_record(self.config, self._data, self.step)),
            )

    def _copy_state(self) -> dict[str, object]:
        return {
            **deepcopy(self._learner.state()),
            "step": self.step,
            "seconds": self.seconds,
            "best_loss": self._best_loss,
            "best_step": self._best_step,
        }

    def _save(self) -> None:
        """Write the last state that was copied, unless it is written already."""
        if self._state is not None:
            write_tensor_file(self._out / STATE_FILE, self._state)
            self._state = None

    def _restore(self, state: dict[str, Any]) -> None:
        self._learner.restore(state)
        self.step, self.seconds = int(state["step"]), float(state["seconds"])
        self._best_loss, self._best_step = float(state["best_loss"]), int(state["best_step"])
