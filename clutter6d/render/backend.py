"""Which renderer this machine has: OpenGL through EGL or OSMesa, or our own ray caster, which needs neither.

A broken OpenGL installation can abort the process, so it is tried in a child process first.
"""

import logging
import os
import subprocess
import sys
from functools import cache
from typing import Literal, cast, get_args

from clutter6d.errors import InvalidValueError, MissingDependencyError, UnknownNameError

Backend = Literal["egl", "osmesa", "raycast"]
GlBackend = Literal["egl", "osmesa"]

DEBIAN_PACKAGES = "libegl1 libgl1-mesa-dri (EGL) or libosmesa6 (OSMesa)"
GL_VARIABLE = "MUJOCO_GL"
LOADED_VARIABLE = "PYOPENGL_PLATFORM"
"""Set by MuJoCo once it has loaded one kind of OpenGL; a process cannot load the other kind as well."""
_DISABLED = ("off", "disable", "disabled", "false", "0")
_PROBE_SECONDS = 60
_PROBE = """
import importlib, sys
import mujoco
context = importlib.import_module("mujoco." + sys.argv[1]).GLContext(64, 64)
context.make_current()
model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='0.1'/></worldbody></mujoco>")
mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
print("ready")
"""

_LOG = logging.getLogger(__name__)


def choose_backend(wanted: str = "auto") -> Backend:
    """The renderer to use.

    Args:
        wanted: ``auto`` takes EGL, else OSMesa, else the ray caster, and follows the environment variable
            ``MUJOCO_GL`` where it names one of them or disables OpenGL; any other name is taken at its word.

    Raises:
        UnknownNameError: There is no such renderer.
        MissingDependencyError: The renderer asked for does not work here; names the system packages.
        InvalidValueError: This process has loaded the other kind of OpenGL before.
    """
    known = get_args(Backend)
    if wanted not in ("auto", *known):
        raise UnknownNameError("rendering backend", wanted, ("auto", *known))
    if wanted == "raycast":
        return "raycast"
    loaded = os.environ.get(LOADED_VARIABLE, "")
    if loaded in get_args(GlBackend) and wanted not in ("auto", loaded):
        raise InvalidValueError(f"this process already draws with '{loaded}'; use '{wanted}' in a process of its own")
    if wanted != "auto":
        if not _works(wanted):
            raise MissingDependencyError(
                f"rendering backend '{wanted}' does not work here; install the system packages {DEBIAN_PACKAGES}, "
                "or use --backend raycast"
            )
        return cast(GlBackend, wanted)
    return _first_that_works(loaded or os.environ.get(GL_VARIABLE, "").lower())


def _first_that_works(preferred: str) -> Backend:
    if preferred not in _DISABLED:
        candidates = [preferred] if preferred in get_args(GlBackend) else list(get_args(GlBackend))
        for name in candidates:
            if _works(name):
                return cast(GlBackend, name)
    _warn_of_ray_caster()
    return "raycast"


@cache
def _warn_of_ray_caster() -> None:
    """Once a process is enough."""
    _LOG.warning(
        "no OpenGL here: drawing with the ray caster, which takes seconds a picture and many minutes a video; "
        "for OpenGL install %s",
        DEBIAN_PACKAGES,
    )


@cache
def _works(name: str) -> bool:
    """Whether a context can be made and MuJoCo can draw into it, tried in a child process."""
    environment = {**os.environ, GL_VARIABLE: name}
    environment.pop(LOADED_VARIABLE, None)
    try:
        done = subprocess.run(
            [sys.executable, "-c", _PROBE, name],
            env=environment,
            capture_output=True,
            text=True,
            timeout=_PROBE_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        _LOG.debug("probe of %s: %s", name, error)
        return False
    _LOG.debug("probe of %s: exit code %d, %s", name, done.returncode, done.stderr[-300:])
    return done.returncode == 0 and "ready" in done.stdout
