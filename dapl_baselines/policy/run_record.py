"""What a training's folder says it is."""

from pathlib import Path
from typing import Final, Literal

from clutter6d.schema import FileModel
from dapl_baselines.policy.settings import TrainingSettings
from dapl_baselines.run_folder import claim

RUN_FILE: Final = "run.json"
_MAY_CHANGE: Final = "settings.iterations"
"""A training may be made longer."""


class RunRecord(FileModel):
    """``run.json``: everything that the outcome of a policy training depends on.

    Attributes:
        schema_version: Of these fields.
        settings: Network, PPO, environments.
        training_sha256: The scenes trained on.
        validation_sha256: The scenes watched on.
        encoder_sha256: The frozen encoder's weights; empty without one.
        start_sha256: Those of the policy that it begins with; empty: random ones.
        device: Where it runs: ``"cpu"`` or ``"cuda"``.
    """

    schema_version: Literal[1] = 1
    settings: TrainingSettings
    training_sha256: str
    validation_sha256: str
    encoder_sha256: str
    start_sha256: str = ""
    device: str


def claim_folder(out: Path, record: RunRecord) -> None:
    """Make a folder this training's, or find that it already is; errors as of :func:`claim`."""
    claim(out / RUN_FILE, record, what="policy training", may_change={_MAY_CHANGE})
