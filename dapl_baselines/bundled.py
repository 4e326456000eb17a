"""Checkpoints that come with the package; ``dapl_baselines/checkpoints`` says how each was made."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Final

from clutter6d.errors import UnknownNameError
from clutter6d.eval.policy import Policy, PolicyOptions
from dapl_baselines.checkpoint import Checkpoint, load_checkpoint_policy, read_checkpoint

FOLDER: Final = Path(__file__).parent / "checkpoints"
BUNDLED: Final[Mapping[str, str]] = {
    "world-model": "world-model.pt",
    "corn-pretrained": "corn.pt",
    "push-teacher": "push-teacher.pt",
    "push-teacher-look-ahead": "push-teacher-look-ahead.pt",
    "dapl-pushes": "dapl-pushes.pt",
}
"""Files by name."""


def find_bundled(name: str) -> Path:
    """The file of a checkpoint that comes with the package.

    Raises:
        UnknownNameError: There is none of that name.
    """
    if name not in BUNDLED:
        raise UnknownNameError("checkpoint", name, BUNDLED)
    return FOLDER / BUNDLED[name]


def open_checkpoint(name_or_file: str) -> Checkpoint:
    """A checkpoint that comes with the package, or any other.

    Args:
        name_or_file: A name in :data:`BUNDLED`, or a ``.pt``.

    Raises:
        MissingFileError: There is no such file.
        InvalidFileError: It is not an acceptable checkpoint.
    """
    return read_checkpoint(find_bundled(name_or_file) if name_or_file in BUNDLED else Path(name_or_file))


def _make(name: str, options: PolicyOptions) -> Policy:
    return load_checkpoint_policy(find_bundled(name), options)


make_teacher: Callable[[PolicyOptions], Policy] = partial(_make, "push-teacher")
"""``--policy push-teacher``: privileged; a critic chooses among pushes."""
make_teacher_with_look_ahead: Callable[[PolicyOptions], Policy] = partial(_make, "push-teacher-look-ahead")
"""``--policy push-teacher-look-ahead``: privileged; the critic's best pushes are tried in the simulator first."""
make_student: Callable[[PolicyOptions], Policy] = partial(_make, "dapl-pushes")
"""``--policy dapl-pushes``: sees points alone, through DAPL's encoder."""
