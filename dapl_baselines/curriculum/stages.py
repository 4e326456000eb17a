"""The stages of a round; each has a folder of its own, goes on where it was stopped, and is passed by when it is over.

round-K/interactions   recordings of what acts in this round (:mod:`dapl_baselines.interactions`)
round-K/world-model    the world model's training on these and all earlier recordings, and its report
round-K/policy         the policy's training on that world model's frozen encoder
round-K/round.json     what came of it, once it is over
"""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import torch

from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.policy_loading import load_policy
from clutter6d.schema import read_model
from dapl_baselines.checkpoint import load_checkpoint_policy, read_checkpoint
from dapl_baselines.curriculum.settings import CurriculumSettings
from dapl_baselines.interactions.dataset import open_interactions
from dapl_baselines.interactions.policy_recording import PolicyRecording
from dapl_baselines.look import POLICY_FILE
from dapl_baselines.policy.encoder_source import open_encoder
from dapl_baselines.policy.policy_start import open_start
from dapl_baselines.policy.training import PolicyTraining
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult, run_validation
from dapl_baselines.world_model.final_report import REPORT_FILE, write_report
from dapl_baselines.world_model.report import Report
from dapl_baselines.world_model.train_config import RunConfig
from dapl_baselines.world_model.trainer import MODEL_FILE, Progress, Trainer

_SHARES = 1_000
"""A world model's training is told in thousandths: minutes may end it, or steps."""


class Stages:
    """What a round does, stage by stage.

    Args:
        scenes: What is recorded, trained on and watched on.
        settings: What every round is made of.
        out: Folder of the curriculum.
        scenes_name: The scenes, as the user named them.
        device: Where networks are trained.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told the name of what is done, how much is, and of how much.
    """

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: CurriculumSettings,
        out: Path,
        *,
        scenes_name: str,
        device: torch.device,
        threads: int,
        observe: Observer,
    ) -> None:
        self._scenes, self._settings, self._out, self._scenes_name = scenes, settings, out, scenes_name
        self._device, self._threads, self._observe = device, threads, observe

    def folder(self, number: int, stage: str = "") -> Path:
        """The folder of a round, or of a stage of it."""
        return self._out / f"round-{number}" / stage

    def record(self, number: int) -> None:
        """Record what acts in a round: the sweep in the first, then the policy of the round before."""
        settings, seed = self._settings, self._settings.seed_of(number)
        for policy, steps in self._recorded_policies(number):
            recording = PolicyRecording(
                self._scenes.training.whole,
                load_policy(policy, PolicyOptions(seed=seed, threads=self._threads)),
                self.folder(number, "interactions"),
                scenes_name=self._scenes_name,
                seed=seed,
                max_steps=settings.record_max_steps,
                threads=self._threads,
            )
            observe = self._observer_of(number)
            for total in recording.run(steps):
                observe("interactions", min(total, steps), steps)

    def _recorded_policies(self, number: int) -> Iterator[tuple[str, int]]:
        """Who is recorded, and for how many steps."""
        steps = self._settings.record_steps
        if number > 1:
            yield str(self.folder(number - 1, "policy") / POLICY_FILE), steps
            return
        random_steps = round(self._settings.random_share * steps)
        plan = (("sweep", steps - random_steps), ("random", random_steps))
        yield from ((policy, count) for policy, count in plan if count)

    def train_world_model(self, number: int) -> Report:
        """Train on all interactions so far, from the second round on beginning with the model of the round before."""
        settings, out, observe = self._settings, self.folder(number, "world-model"), self._observer_of(number)
        if (out / REPORT_FILE).is_file():
            return read_model(out / REPORT_FILE, Report, what="report of a world model")
        data = open_interactions([self.folder(one, "interactions") for one in range(1, number + 1)])
        train = settings.train.model_copy(update={"seed": settings.seed_of(number)})
        config = RunConfig(model=settings.model, loss=settings.loss, train=train, data_sha256=data.sha256)
        start = read_checkpoint(self.folder(number - 1, "world-model") / MODEL_FILE) if number > 1 else None
        trainer = Trainer(data, out, config, self._device, start)

        def show(standing: Progress) -> None:
            observe("world model", round(_SHARES * standing.share), _SHARES)

        trainer.run(show)
        return write_report(trainer, data, out, observe)

    def train_policy(self, number: int) -> float:
        """Train on the world model's encoder, from the second round on beginning with the policy of the round before.

        Returns:
            The time of rollouts and updates [s].
        """
        settings, observe = self._settings, self._observer_of(number)
        training = PolicyTraining(
            self._scenes,
            settings.policy.model_copy(update={"seed": settings.seed_of(number)}),
            self.folder(number, "policy"),
            encoder=open_encoder(str(self.folder(number, "world-model") / MODEL_FILE), seed=0),
            start=open_start(self.folder(number - 1, "policy") / POLICY_FILE) if number > 1 else None,
            device=self._device.type,
            threads=self._threads,
            observe=observe,
        )
        with closing(training.run()) as reports:
            for report in reports:
                observe("policy", report.iteration, settings.policy.iterations)
        return training.standing.seconds

    def evaluate(self, number: int) -> ValidationResult:
        """How the policy does on the validation scenes as its training left it, which need not be its best look."""
        policy = load_checkpoint_policy(self.folder(number, "policy") / POLICY_FILE, PolicyOptions())
        return run_validation(
            policy,
            self._scenes.validation,
            max_steps=self._settings.policy.max_steps,
            threads=self._threads,
            observe=self._observer_of(number),
        )

    def _observer_of(self, number: int) -> Observer:
        """An observer that says which round it is."""

        def observe(name: str, done: int, total: int) -> None:
            self._observe(f"round {number} of {self._settings.rounds}: {name}", done, total)

        return observe
