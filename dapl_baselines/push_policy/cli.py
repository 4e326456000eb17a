"""The command ``dapl look-ahead``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.errors import InvalidFileError
from dapl_baselines.bundled import open_checkpoint
from dapl_baselines.checkpoint import write_checkpoint
from dapl_baselines.push_policy.critic import PushCritic


def look_ahead(
    policy: Annotated[str, typer.Option(help="The .pt of dapl train teacher; or push-teacher, which comes along.")],
    out: Annotated[Path, typer.Option(help="Where the teacher that looks ahead is written.")],
    pushes: Annotated[
        int, typer.Option(min=0, max=256, help="Pushes that are tried at each decision; 0: the critic alone decides.")
    ] = 16,
) -> None:
    """Make a teacher that tries its best pushes in copies of the simulation before it carries one out."""
    checkpoint = open_checkpoint(policy)
    critic, header = checkpoint.module, checkpoint.header
    if not isinstance(critic, PushCritic):
        raise InvalidFileError(policy, f"holds a {header.architecture}; give a teacher of dapl train teacher")
    config = critic.config.model_copy(update={"look_ahead": pushes})
    write_checkpoint(
        out,
        architecture=header.architecture,
        config=config,
        module=critic,
        history=header.history,
        precision=header.precision,
    )
    said = f"tries {pushes} pushes before each decision" if pushes else "decides by its critic alone"
    Console(markup=False, emoji=False).print(f"{out}: a teacher that {said}", highlight=False)
