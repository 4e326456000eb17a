"""A look at a policy in training: how the checkpoint just written does on the validation scenes; the best is kept."""

from dataclasses import replace
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


def look_at(
    folder: Path, scenes: SceneSubset, standing: Standing, *, max_steps: int, threads: int, observe: Observer
) -> tuple[ValidationResult, Standing]:
    """See how a folder's ``policy.pt`` does as it was written, and copy it to ``best.pt`` if none before did as well.

    Args:
        folder: Of the training.
        scenes: The validation scenes.
        standing: How far the training is.
        max_steps: Control steps of an episode at most.
        threads: Threads of the simulation; 0 for all cores.
        observe: Told of the episodes, as they end.

    Returns:
        What was seen, and the standing that knows of it.

    Raises:
        InvalidFileError: The checkpoint is damaged.
        StorageError: The best cannot be written.
    """
    path = folder / POLICY_FILE
    policy = load_checkpoint_policy(path, PolicyOptions())
    result = run_validation(policy, scenes, max_steps=max_steps, threads=threads, observe=observe)
    if result.success_rate > standing.best_success:
        write_bytes(folder / BEST_FILE, path.read_bytes())
        standing = replace(standing, best_success=result.success_rate)
    return result, standing
