"""Where a vector environment runs: on this machine's cores, or on a GPU."""

from importlib import import_module
from typing import Any, Final

import gymnasium

from clutter6d.errors import InvalidValueError

_CPU_ONLY: Final = ("threads", "render_mode", "unstable_dir")


def make_vector_env(*, device: str = "cpu", **options: Any) -> gymnasium.vector.VectorEnv[Any, Any, Any]:
    """What ``gymnasium.make_vec`` makes.

    Args:
        device: ``"cpu"``: MuJoCo on all cores; ``"cuda"``, ``"cuda:1"`` ...: MuJoCo Warp on a GPU, whose modules are
            loaded only then.
        options: Of :class:`~clutter6d.envs.vector_env.ClutterVectorEnv` or
            :class:`~clutter6d.envs.warp_env.WarpVectorEnv`.

    Raises:
        InvalidValueError: There is no such device, or an option that environments on it do not have.
        MissingDependencyError: The GPU back end is not installed.
    """
    if device == "cpu":
        return import_module("clutter6d.envs.vector_env").ClutterVectorEnv(**options)
    for name in _CPU_ONLY:
        if options.get(name) is not None:
            raise InvalidValueError(f"{name} is not available on the device '{device}'; leave it or device out")
    wanted = {name: value for name, value in options.items() if name not in _CPU_ONLY}
    return import_module("clutter6d.envs.warp_env").WarpVectorEnv(device=device, **wanted)
