"""A policy's training in a folder: continued where it was stopped, watched on the validation scenes.

run.json            everything the outcome depends on
state.pt            how far it is: networks, optimiser, random numbers, every environment's simulation
training.csv        one row an iteration: losses, learning rate, and what became of the episodes
validation.csv      one row a look at the validation scenes
policy.pt, best.pt  the policy at the last look, and at the best
tensorboard/        the same curves
"""

import time
from collections.abc import Generator
from contextlib import closing, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Final, cast

from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.curves import Curves
from dapl_baselines.look import Lookout
from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.policy.iteration_report import IterationReport
from dapl_baselines.policy.policy_start import PolicyStart, history_before
from dapl_baselines.policy.ppo import UnifiedPPO, assemble, begin_with
from dapl_baselines.policy.rollout_env import make_rollout_env
from dapl_baselines.policy.rsl_runner import Rank, make_runner
from dapl_baselines.policy.run_record import RunRecord, claim_folder
from dapl_baselines.policy.settings import TrainingSettings
from dapl_baselines.policy.training_state import copy_training_state, read_training_state
from dapl_baselines.tensor_file import write_tensor_file
from dapl_baselines.training_history import environment_record
from dapl_baselines.training_report import Standing
from dapl_baselines.validation import TrainingScenes
from dapl_baselines.validation_run import Observer, ValidationResult, ignore

ARCHITECTURE: Final = "policy-network"
STATE_FILE: Final = "state.pt"
SAVE_SECONDS: Final = 30.0
"""Time between two states on disk: what a kill costs at most, beside a look that was under way."""


class PolicyTraining:
    """One training in one folder, new or continued.

    Args:
        scenes: What is trained and watched on.
        settings: Everything the user chooses; its network's encoder is replaced by that of ``encoder``.
        out: The folder.
        encoder: The frozen encoder; ``None``: the policy sees no points.
        start: The policy it begins with; ``None``: random weights.
        device: ``"cpu"`` or ``"cuda"``.
        threads: Threads of the simulation; 0 for all cores.
        save_seconds: Time between two states on disk.
        observe: Told of the episodes of a look, as they end.

    Attributes:
        standing: How far it is.

    Raises:
        InvalidValueError: The folder holds a training with other settings, or something else; or ``start`` is a policy
            of another kind.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    def __init__(
        self,
        scenes: TrainingScenes,
        settings: TrainingSettings,
        out: Path,
        *,
        encoder: EncoderSource | None = None,
        start: PolicyStart | None = None,
        device: str = "cpu",
        threads: int = 0,
        save_seconds: float = SAVE_SECONDS,
        observe: Observer = ignore,
    ) -> None:
        network = settings.network.model_copy(update={"encoder": encoder and encoder.config})
        network = network if start is None else start.fitted(network)
        self.settings = settings.model_copy(update={"network": network})
        self._scenes, self._out, self._source, self._start = scenes, out, encoder, start
        self._lookout = Lookout(
            folder=out, scenes=scenes.validation, max_steps=settings.max_steps, threads=threads, observe=observe
        )
        self._save_seconds, self._saved_at = save_seconds, time.monotonic()
        self._rank = Rank.of_environment(device)
        if self._rank.is_main:
            claim_folder(out, self._record(device))
        self._env = make_rollout_env(
            scenes.training, self.settings, encoder, device=self._rank.device, rank=self._rank.index, threads=threads
        )
        self._runner = make_runner(self._env, self.settings, self._rank)
        if start is not None:
            begin_with(start.network, cast(UnifiedPPO, self._runner.alg))
        self._state: dict[str, object] | None = None
        self.standing = Standing()
        if (out / STATE_FILE).is_file():
            self.standing = read_training_state(out / STATE_FILE, self._runner, self._env)
            # On a GPU, where episodes begin anew, the curriculum of the action scale must not.
            self._env.envs.training_step = self.standing.iteration * settings.steps_per_env

    def run(self) -> Generator[IterationReport, None, None]:
        """Make the iterations that are left; each is yielded when it is made.

        Closed early, interrupted, or ended by an error, it loses nothing but the iteration that was under way.
        """
        curves = Curves(self._out, self.standing.iteration) if self._rank.is_main else None
        with nullcontext() if curves is None else closing(curves):
            try:
                while self.standing.iteration < self.settings.iterations:
                    report = self._iterate()
                    if curves is not None:
                        self._keep(report, curves)
                    yield report
            finally:
                self._write_state()

    def _iterate(self) -> IterationReport:
        """One rollout, one update, and a look at the validation scenes if it is time for one."""
        start, number = time.monotonic(), self.standing.iteration + 1
        update, episodes = self._runner.learn_once(), self._env.tally.take()
        seconds = self.standing.seconds + time.monotonic() - start
        self.standing = replace(self.standing, iteration=number, seconds=seconds)
        is_time = number % self.settings.evaluate_every == 0 or number == self.settings.iterations
        return IterationReport(
            iteration=number,
            environment_steps=self._environment_steps,
            seconds=seconds,
            action_scale_rad=self._env.envs.action_scale_rad,
            episodes=episodes,
            update=update,
            validation=self._look() if is_time and self._rank.is_main else None,
        )

    def _keep(self, report: IterationReport, curves: Curves) -> None:
        """Write the curves; remember the state, and write it now and then."""
        curves.add("training", report.iteration, report.curve_row())
        if report.validation is not None:
            curves.add("validation", report.iteration, report.validation_row())
        self._state = copy_training_state(self.standing, self._runner, self._env)
        if report.validation is not None or time.monotonic() - self._saved_at >= self._save_seconds:
            self._write_state()

    def _write_state(self) -> None:
        if self._state is not None:
            write_tensor_file(self._out / STATE_FILE, self._state)
            self._state, self._saved_at = None, time.monotonic()

    def _look(self) -> ValidationResult:
        """Write the policy, and see how it does as it was written."""
        result, self.standing = self._lookout.look(self._write_policy, self.standing)
        return result

    def _write_policy(self, path: Path) -> None:
        scale = {"action_scale_rad": self._env.envs.action_scale_rad}
        config = self.settings.network.model_copy(update=scale)
        network = assemble(config, cast(UnifiedPPO, self._runner.alg), self._source and self._source.module)
        record = environment_record(
            "ppo",
            steps=self._environment_steps,
            seed=self.settings.seed,
            scenes=self._scenes,
            settings=self.settings,
        )
        write_checkpoint(
            path,
            architecture=ARCHITECTURE,
            config=config,
            module=network,
            history=(*history_before(self._source, self._start), record),
            precision=self.settings.stored_precision,
        )

    @property
    def _environment_steps(self) -> int:
        settings = self.settings
        return self.standing.iteration * settings.steps_per_env * settings.envs * self._runner.gpu_world_size

    def _record(self, device: str) -> RunRecord:
        return RunRecord(
            settings=self.settings,
            training_sha256=self._scenes.training.sha256,
            validation_sha256=self._scenes.validation.sha256,
            encoder_sha256="" if self._source is None else self._source.sha256,
            start_sha256="" if self._start is None else self._start.sha256,
            device=device,
        )
