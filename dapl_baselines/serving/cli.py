"""The commands ``dapl export`` and ``dapl serve``."""

import asyncio
from functools import partial
from pathlib import Path
from typing import Annotated, Final, cast, get_args

import typer
from rich.console import Console

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.progress import progress_bars
from dapl_baselines.serving.manifest import FILES, Format

LOOPBACK: Final = ("127.0.0.1", "::1", "localhost")


def export(
    checkpoint: Annotated[Path, typer.Argument(help="A policy's .pt checkpoint.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the exported policy; by default exported-policies/CHECKPOINT.")
    ] = None,
    formats: Annotated[str, typer.Option("--format", help="onnx, torchscript, or both.")] = "onnx,torchscript",
) -> None:
    """Export a policy to files that run without this code, and compare each with the checkpoint."""
    from dapl_baselines.serving.export import export_policy  # imports PyTorch, which serving must not

    chosen = parse_formats(formats)
    folder = out or Path("exported-policies") / checkpoint.stem
    console = Console(markup=False, emoji=False, highlight=False)
    with progress_bars(console) as progress:
        bar = progress.add_task("exporting", total=len(chosen))
        for file in export_policy(checkpoint, folder, chosen):
            progress.advance(bar)
            console.print(f"{folder / FILES[file.format]}: at most {file.parity_rad:.1g} rad from the checkpoint")
    console.print(f"serve it with: dapl serve {folder}")


def serve(
    policy: Annotated[
        str, typer.Argument(help="A folder made by dapl export, or what clutter6d evaluate --policy takes.")
    ],
    host: Annotated[
        str, typer.Option(help="Address to listen on; by default this machine alone can connect.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 8000,
) -> None:
    """Serve a policy over a websocket until Ctrl-C: an observation in, joint residuals out."""
    from dapl_baselines.serving.served_policy import open_policy, try_out
    from dapl_baselines.serving.server import Address, serve_until_stopped

    console = Console(markup=False, emoji=False, highlight=False, soft_wrap=True)
    with console.status("loading the policy"):
        opened = open_policy(policy)
        try_out(opened)
    if host not in LOOPBACK:
        console.print(f"warning: whoever can reach {host} can use this policy; there is no password")
    announce = partial(_announce, console, opened.name)
    asyncio.run(serve_until_stopped(opened, Address(host=host, port=port), announce))
    console.print("stopped")


def parse_formats(text: str) -> tuple[Format, ...]:
    """Formats by name, with commas between them.

    Raises:
        UnknownNameError: There is no such format.
        InvalidValueError: None is named.
    """
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in get_args(Format):
            raise UnknownNameError("format", name, get_args(Format))
    if not names:
        raise InvalidValueError(f"--format '{text}' names none; give one or more of {', '.join(get_args(Format))}")
    return cast(tuple[Format, ...], names)


def _announce(console: Console, name: str, url: str) -> None:
    console.print(f"{name}: {url} (stop with Ctrl-C)")
