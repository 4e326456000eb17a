"""What runs inside a Ray actor: it keeps one worker process warm, and so has limits, stages and deaths as locally.

The actor itself runs nothing that could kill it. If it dies, its machine or someone from outside is to blame, and the
item can be given to another actor without asking whether it was the item's fault.
"""

import os
import platform
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from clutter6d.executor.task_queue import Outcome
from clutter6d.executor.tasks import TaskLimits
from clutter6d.executor.wire import Payload
from clutter6d.executor.worker import Worker

_DECISIVE = ("clutter6d", "coacd", "manifold3d", "mujoco", "numpy", "scipy", "trimesh", "torch")
"""Libraries whose versions results may depend on."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Surroundings:
    """What a worker takes over from the process that asks for it.

    Attributes:
        folder: Working directory, for relative paths; kept only where it exists.
        search_path: Where Python finds modules.
        variables: Environment variables of this package.
    """

    folder: str = field(default_factory=lambda: str(Path.cwd()))
    search_path: tuple[str, ...] = field(default_factory=lambda: tuple(path or str(Path.cwd()) for path in sys.path))
    variables: Mapping[str, str] = field(
        default_factory=lambda: {name: value for name, value in os.environ.items() if name.startswith("CLUTTER6D_")}
    )

    def take_over(self) -> None:
        """Make them this process's own."""
        os.environ.update(self.variables)
        sys.path[:] = self.search_path
        if Path(self.folder).is_dir():
            os.chdir(self.folder)


class RayWorker:
    """The actor: one worker process on some machine of the cluster.

    Args:
        function: What it applies, encoded.
        limits: Of each item.
        surroundings: Of the driver.
    """

    def __init__(self, function: Payload, limits: TaskLimits, surroundings: Surroundings) -> None:
        surroundings.take_over()
        with _no_main_module():
            self._worker = Worker(function, limits)

    def environment(self) -> tuple[str, dict[str, str]]:
        """The machine's name, and the versions of what results depend on."""
        return platform.node(), library_versions()

    def run(self, index: int, item: Payload) -> Outcome:
        """Apply the function to one item; returns whatever becomes of it."""
        with _no_main_module():
            self._worker.start(index, item)
        return self._worker.wait()


def library_versions() -> dict[str, str]:
    """The versions of what results depend on, as far as it is installed."""
    found = {"Python": ".".join(platform.python_version_tuple()[:2])}
    for name in _DECISIVE:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


@contextmanager
def _no_main_module() -> Iterator[None]:
    """Children would else run the main module of the Ray worker again, which imports all of Ray."""
    main = sys.modules["__main__"]
    path = getattr(main, "__file__", None)
    main.__file__ = None
    try:
        yield
    finally:
        main.__file__ = path
