"""A pretraining on contacts in a folder; a killed one goes on and ends as if it had not been killed.

run.json          everything the outcome depends on
state.pt          weights, optimiser and step, to go on from
corn.pt           the checkpoint with the lowest loss on the objects that are held out
losses.csv, validation.csv, tensorboard/   curves
"""

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Literal, cast

import torch
from pydantic import JsonValue
from torch import nn

from clutter6d.assets.asset import Asset
from clutter6d.errors import InvalidValueError
from clutter6d.schema import FileModel
from clutter6d.seeding import generator
from dapl_baselines.checkpoint import TrainingRecord, write_checkpoint
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.contact_pretraining.contact_errors import ContactErrors, errors_of, logits_of, loss_of
from dapl_baselines.contact_pretraining.contact_model import ContactModel
from dapl_baselines.contact_pretraining.examples import ContactExamples, ContactShapes, draw_examples
from dapl_baselines.contact_pretraining.settings import ContactSettings
from dapl_baselines.curves import Curves
from dapl_baselines.prefetching import prefetched
from dapl_baselines.run_folder import claim
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_state import take_up

RUN_FILE, STATE_FILE, MODEL_FILE = "run.json", "state.pt", "corn.pt"
ARCHITECTURE: Final = "contact-model"
HELD_OUT_SHARE: Final = 16
"""One object of so many is held out, at least one."""


class ContactRecord(FileModel):
    """``run.json``: everything that the outcome depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Of the training.
        scenes_sha256: Names the scenes whose objects are trained on.
    """

    schema_version: Literal[1] = 1
    settings: ContactSettings
    scenes_sha256: str


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactReport:
    """Some steps of a training.

    Attributes:
        step: Steps made.
        loss: Their mean cross-entropy of a patch [nats].
        errors: On the objects that are held out, if they were looked at.
    """

    step: int
    loss: float
    errors: ContactErrors | None = None


class ContactTraining:
    """A training in a folder, new or gone on with.

    Args:
        assets: Objects to touch; the last sixteenth by their hashes is held out.
        scenes_sha256: Names where these are from.
        settings: Everything the user chooses.
        out: The folder.

    Raises:
        InvalidValueError: The folder is of another training or of something else; or there are fewer than two objects.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.

    Attributes:
        step: Steps made.
        best: The errors of the model that is kept; ``None`` before the first look.
    """

    def __init__(self, assets: Sequence[Asset], scenes_sha256: str, settings: ContactSettings, out: Path) -> None:
        if len(assets) < 2:
            raise InvalidValueError(f"{len(assets)} objects are too few to train on: one is held out; give at least 2")
        self.settings, self._out = settings, out
        self._record = ContactRecord(settings=settings, scenes_sha256=scenes_sha256)
        claim(out / RUN_FILE, self._record, what="contact training")
        ordered = sorted(assets, key=lambda asset: asset.content_hash)
        held_out = max(1, len(ordered) // HELD_OUT_SHARE)
        self._shapes = ContactShapes.of(ordered[:-held_out])
        rng = generator(settings.seed, "watched contacts")
        self._watched = draw_examples(ContactShapes.of(ordered[-held_out:]), settings.examples, settings.watched, rng)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(settings.seed)
            self._model = ContactModel(settings.model)
        self._optimizer = torch.optim.AdamW(self._model.parameters(), weight_decay=settings.weight_decay)
        self.step = 0
        self.best: ContactErrors | None = None
        if (out / STATE_FILE).is_file():
            take_up(out / STATE_FILE, self._restore)

    def run(self) -> Generator[ContactReport, None, None]:
        """Make the steps that are left; some at a time, with a state on disk after each of these."""
        settings, losses = self.settings, list[float]()
        batches = prefetched(self._draw, range(self.step, settings.steps))
        with closing(Curves(self._out, self.step, counted="step")) as curves, closing(batches):
            for batch in batches:
                losses.append(self._make_step(batch))
                self.step += 1
                is_last = self.step == settings.steps
                if not (is_last or self.step % settings.save_every == 0):
                    continue
                loss, losses = sum(losses) / len(losses), []
                curves.add("losses", self.step, {"loss": loss, "learning_rate": settings.learning_rate_at(self.step)})
                errors = self._look(curves) if is_last or self.step % settings.evaluate_every == 0 else None
                write_tensor_file(self._out / STATE_FILE, self._state())
                yield ContactReport(step=self.step, loss=loss, errors=errors)

    def _draw(self, step: int) -> ContactExamples:
        rng = generator(self.settings.seed, "contacts", step)
        return draw_examples(self._shapes, self.settings.examples, self.settings.batch, rng)

    def _make_step(self, batch: ContactExamples) -> float:
        (group,) = self._optimizer.param_groups
        group["lr"] = self.settings.learning_rate_at(self.step)
        loss = loss_of(logits_of(self._model, batch), batch.is_touched)
        self._optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._model.parameters(), self.settings.max_grad_norm)
        self._optimizer.step()
        return float(loss.detach())

    def _look(self, curves: Curves) -> ContactErrors:
        """Look at the objects that are held out, and keep the model if it never was better."""
        errors = errors_of(self._model, self._watched)
        curves.add("validation", self.step, asdict(errors))
        if self.best is None or errors.loss < self.best.loss:
            self.best = errors
            write_checkpoint(
                self._out / MODEL_FILE,
                architecture=ARCHITECTURE,
                config=self.settings.model,
                module=self._model,
                history=(self._training_record(),),
                precision=self.settings.stored_precision,
            )
        return errors

    def _training_record(self) -> TrainingRecord:
        return TrainingRecord(
            method="contacts",
            steps=self.step,
            unit="optimiser steps",
            seed=self.settings.seed,
            split_sha256=self._record.scenes_sha256,
            code_sha256=code_sha256(),
            settings=cast(dict[str, JsonValue], self.settings.model_dump(mode="json")),
        )

    def _state(self) -> dict[str, object]:
        return {
            "model": self._model.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "step": self.step,
            "best": None if self.best is None else asdict(self.best),
        }

    def _restore(self, state: dict[str, Any]) -> None:
        self._model.load_state_dict(state["model"])
        self._optimizer.load_state_dict(state["optimizer"])
        self.step = int(state["step"])
        self.best = None if state["best"] is None else ContactErrors(**state["best"])
