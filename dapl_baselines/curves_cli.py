"""The command ``dapl show-curves``."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.schema import write_bytes
from dapl_baselines.curves_picture import draw_curves, read_course
from dapl_baselines.world_model.picture import check_matplotlib


def show_curves(
    run: Annotated[list[Path], typer.Option(help="Folder of a training of a policy; may be given more than once.")],
    out: Annotated[Path, typer.Option(help="The PNG to write.")] = Path("curves.png"),
) -> None:
    """Draw learning curves: success on held-out scenes, and of what is practised, over hours and over control steps."""
    check_matplotlib()
    trainings = {folder.name: read_course(folder) for folder in run}
    write_bytes(out, draw_curves(trainings))
    best = ", ".join(
        f"{name} {max(look.success_rate for look in course.looks):.1%}" for name, course in trainings.items()
    )
    Console(markup=False, emoji=False).print(f"{out}: best looks: {best}", highlight=False)
