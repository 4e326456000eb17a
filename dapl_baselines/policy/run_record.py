"""What a training's folder says it is."""

from pathlib import Path
from typing import Any, Final, Literal, cast

from clutter6d.errors import InvalidValueError
from clutter6d.schema import FileModel, read_model, write_model
from dapl_baselines.policy.settings import TrainingSettings

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
        device: Where it runs: ``"cpu"`` or ``"cuda"``.
    """

    schema_version: Literal[1] = 1
    settings: TrainingSettings
    training_sha256: str
    validation_sha256: str
    encoder_sha256: str
    device: str


def claim_folder(out: Path, record: RunRecord) -> None:
    """Make a folder this training's, or find that it already is.

    Raises:
        InvalidValueError: It holds a training with other settings, or something else.
        InvalidFileError: Its ``run.json`` is damaged.
        StorageError: It cannot be written.
    """
    path = out / RUN_FILE
    if path.is_file():
        before, now = _flat(read_model(path, RunRecord, what="policy training")), _flat(record)
        changed = [name for name in now if before.get(name) != now[name] and name != _MAY_CHANGE]
        if changed:
            what = f"{changed[0]} was {before.get(changed[0])}, is {now[changed[0]]}"
            raise InvalidValueError(f"{out} is of a training with other settings ({what}); choose another --out")
    elif out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise InvalidValueError(f"{out} is neither an empty folder nor a policy training; choose another --out")
    write_model(path, record)


def _flat(record: FileModel) -> dict[str, object]:
    """All values by their path."""

    def walk(prefix: str, value: object) -> dict[str, object]:
        if not isinstance(value, dict):
            return {prefix: value}
        found: dict[str, object] = {}
        for name, part in cast(dict[str, Any], value).items():
            found |= walk(f"{prefix}.{name}" if prefix else name, part)
        return found

    return walk("", record.model_dump(mode="json"))
