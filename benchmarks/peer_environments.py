"""Environments of their own for the programs that ours is compared with, made once in the cache folder."""

import subprocess
import venv
from collections.abc import Sequence
from pathlib import Path

from clutter6d.assets.cache import cache_folder

PROGRAMS = Path(__file__).parent / "peers"


def peer_python(packages: Sequence[str]) -> Path | None:
    """The interpreter of an environment with these packages, made if it is not there yet.

    Args:
        packages: Requirements; the first one is the peer, and gives the environment its name.

    Returns:
        The interpreter; ``None`` if the packages could not be installed.
    """
    folder = cache_folder() / "peers" / packages[0].replace("==", "-")
    python = folder / "bin" / "python"
    wanted, complete = "\n".join(packages), folder / "complete"
    if not complete.exists() or complete.read_text() != wanted:
        print(f"making an environment for {', '.join(packages)} in {folder}; this can take minutes", flush=True)
        venv.create(folder, with_pip=True, clear=True)
        if subprocess.run([python, "-m", "pip", "install", "--quiet", *packages], check=False).returncode:
            print(f"{packages[0]} could not be installed: ours is not compared with it")
            return None
        complete.write_text(wanted)
    return python
