"""A look at a policy in training: how the checkpoint just written does on the validation scenes; the best is kept."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from clutter6d.eval.policy import PolicyOptions
from clutter6d.schema import write_bytes
from dapl_baselines.checkpoint import load_checkpoint_policy
from dapl_baselines.training_report import Standing
from dapl_baselines.validation import SceneSubset
from dapl_baselines.validation_run import Observer, ValidationResult, run_validation

POLICY_FILE: Final = "policy.pt"
BEST_FILE: Final = "best.pt"


@dataclass(frozen=True, kw_only=True, slots=True)
class Lookout:
    """Where a training's policy is looked at, and how.

    Attributes:
        folder: Of the training.
        scenes: The validation scenes.
        max_steps: Control steps of an episode at most.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the episodes, as they end.
    """

    folder: Path
    scenes: SceneSubset
    max_steps: int
    threads: int
    observe: Observer

    def look(self, write: Callable[[Path], None], standing: Standing) -> tuple[ValidationResult, Standing]:
        """Have ``policy.pt`` written, see how it does as it was written, and keep it as ``best.pt`` if it is better.

        Args:
            write: Writes the policy to a file as a checkpoint.
            standing: How far the training is.

        Returns:
            What was seen, and the standing that knows of it.

        Raises:
            InvalidFileError: The checkpoint is damaged.
            StorageError: It, or the best, cannot be written.
        """
        path = self.folder / POLICY_FILE
        write(path)
        policy = load_checkpoint_policy(path, PolicyOptions())
        result = run_validation(
            policy, self.scenes, max_steps=self.max_steps, threads=self.threads, observe=self.observe
        )
        if result.success_rate > standing.best_success:
            write_bytes(self.folder / BEST_FILE, path.read_bytes())
            standing = replace(standing, best_success=result.success_rate)
        return result, standing
