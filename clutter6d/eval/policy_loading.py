"""Finding a policy by what stands behind ``--policy``."""

import sys
from collections.abc import Callable, Iterable
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import cast

from clutter6d.errors import (
    InvalidValueError,
    MissingDependencyError,
    MissingFileError,
    UnknownNameError,
)
from clutter6d.eval.policy import Policy, PolicyFactory, PolicyOptions, blaming

ENTRY_POINT_GROUP = "clutter6d.policies"
CHECKPOINT_ENTRY_POINT = "checkpoint"

_POLICY_VALUES: dict[str, type] = {"name": str, "policy_hash": str, "is_privileged": bool, "needs_observation": bool}
"""The values that a policy must have, by type."""


def load_policy(spec: str, options: PolicyOptions | None = None) -> Policy:
    """Make a policy from what stands behind ``--policy``.

    Args:
        spec: A name (``zero``, ``random``, ``planner``, ...), ``package.module:factory``, or a ``.pt`` checkpoint.
        options: Seed and threads.

    Raises:
        UnknownNameError: No such name, module or factory.
        MissingFileError: No such checkpoint.
        InvalidFileError: The checkpoint is not acceptable.
        MissingDependencyError: The policy needs a package that is not installed.
        InvalidValueError: The module or factory fails.
    """
    chosen = options or PolicyOptions()
    known = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    if Path(spec).suffix == ".pt":
        return _load_checkpoint(Path(spec), chosen, known)
    names = [name for name in known if name != CHECKPOINT_ENTRY_POINT]
    if spec in names:
        factory = _import(spec, known[spec].value, names)
    elif ":" in spec:
        factory = _import(spec, spec, names)
    else:
        raise UnknownNameError("policy", spec, [*names, "package.module:factory", "checkpoint.pt"])
    with blaming(f"policy '{spec}': its factory"):
        policy = cast(PolicyFactory, factory)(chosen)
    return _checked(spec, policy)


def _load_checkpoint(path: Path, options: PolicyOptions, known: dict[str, EntryPoint]) -> Policy:
    if not path.is_file():
        raise MissingFileError("checkpoint", path)
    if CHECKPOINT_ENTRY_POINT not in known:
        raise MissingDependencyError(f"no package that reads checkpoints is installed, needed for {path}")
    point = known[CHECKPOINT_ENTRY_POINT]
    loader = cast(Callable[[Path, PolicyOptions], Policy], _import(point.name, point.value, known))
    return _checked(str(path), loader(path, options))


def _import(spec: str, target: str, known: Iterable[str]) -> object:
    module_name, _, attribute = target.partition(":")
    if not all(part.isidentifier() for part in [*module_name.split("."), attribute]):
        raise InvalidValueError(f"policy '{spec}' is not of the form package.module:factory")
    _see_working_directory()
    try:
        with blaming(f"policy '{spec}': importing {module_name}"):
            module = import_module(module_name)
    except InvalidValueError as error:
        cause = error.__cause__
        if not isinstance(cause, ModuleNotFoundError) or not cause.name:
            raise
        if f"{module_name}.".startswith(f"{cause.name}."):
            raise UnknownNameError("policy module", module_name, known) from None
        raise MissingDependencyError(f"policy '{spec}' needs the package '{cause.name}'; install it") from None
    factory = getattr(module, attribute, None)
    if not callable(factory):
        callables = [name for name in dir(module) if callable(getattr(module, name)) and not name.startswith("_")]
        raise UnknownNameError(f"factory in {module_name}", attribute, callables)
    return factory


def _checked(spec: str, policy: object) -> Policy:
    if isinstance(policy, type):
        raise InvalidValueError(
            f"policy '{spec}' gave the class {policy.__name__}, not a policy; name the class itself"
        )
    for name in (*_POLICY_VALUES, "begin", "act"):
        if not hasattr(policy, name):
            raise InvalidValueError(f"policy '{spec}' is a {type(policy).__name__} without '{name}'")
        value: object = getattr(policy, name)
        if not (isinstance(value, _POLICY_VALUES[name]) if name in _POLICY_VALUES else callable(value)):
            kind = _POLICY_VALUES[name].__name__ if name in _POLICY_VALUES else "method"
            raise InvalidValueError(f"policy '{spec}': its '{name}' is a {type(value).__name__}, expected a {kind}")
    return cast(Policy, policy)


def _see_working_directory() -> None:
    """Let a module in the working directory be found, after all installed ones."""
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))
