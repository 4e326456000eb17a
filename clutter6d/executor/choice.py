"""Where tasks run: what stands behind ``--executor``."""

import re
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal

from clutter6d.errors import InvalidValueError, MissingDependencyError, UnknownNameError

EXECUTOR_HELP = (
    "Where the workers run: local; ray, which starts Ray on this machine; or ray:ADDRESS, which joins a Ray cluster."
)
"""What a command says of its ``--executor``."""

_ADDRESS = re.compile(r"auto|(ray://)?(\[[0-9a-fA-F:]+\]|[A-Za-z0-9._-]+):[0-9]{1,5}")


@dataclass(frozen=True, kw_only=True, slots=True)
class Executor:
    """Where tasks run; results do not depend on it.

    Attributes:
        kind: ``local`` for processes of this machine, ``ray`` for the actors of a Ray cluster.
        address: Of the cluster, as ``ray.init`` takes it; empty for a Ray of this machine's own, started when needed.
    """

    kind: Literal["local", "ray"] = "local"
    address: str = ""


LOCAL = Executor()


def parse_executor(text: str) -> Executor:
    """The executor that ``local``, ``ray`` or ``ray:ADDRESS`` stands for.

    Raises:
        UnknownNameError: There is no such executor.
        InvalidValueError: The address is not ``auto`` or ``HOST:PORT``, or ``local`` has one.
        MissingDependencyError: Ray is wanted and not installed.
    """
    kind, colon, address = text.partition(":")
    if kind == "local" and not colon:
        return LOCAL
    if kind == "local":
        raise InvalidValueError(f"executor '{text}': local processes have no address; write local, or ray:{address}")
    if kind != "ray":
        raise UnknownNameError("executor", kind, ["local", "ray", "ray:ADDRESS"])
    if colon and not _ADDRESS.fullmatch(address):
        raise InvalidValueError(f"executor '{text}': the address is neither auto nor HOST:PORT, such as ray:head:6379")
    if find_spec("ray") is None:
        raise MissingDependencyError(f"executor '{text}' needs Ray; run: pip install \"clutter6d[ray]\"")
    return Executor(kind="ray", address=address)
