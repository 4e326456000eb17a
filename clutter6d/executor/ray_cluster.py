"""Joining a Ray cluster, or starting a Ray of this machine's own: quiet, on the loopback address, without telemetry."""

import logging
import os
import socket
import sys
from typing import Any

from clutter6d.errors import InvalidValueError

_ANSWERS_WITHIN_S = 10.0
_OBJECT_STORE_BYTES = 256 << 20
_QUIET = {
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_DEDUP_LOGS_SKIP_REGEX": ".*",  # what the cluster would print on this terminal, into the progress bar
    "RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO": "0",
}
_ALONE = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # on every system: servers listen on 127.0.0.1 only
    "RAY_enable_metrics_collection": "0",
}


def connect(address: str, workers: int) -> Any:
    """The ``ray`` module, connected; a connection that this process has already is kept.

    Args:
        address: Of the cluster; empty to start a Ray on this machine, which ends with this process.
        workers: CPUs that a Ray started here has.

    Raises:
        InvalidValueError: No cluster answers at the address, Ray does not start, or CoACD was loaded before it.
    """
    for name, value in {**_QUIET, **({} if address else _ALONE)}.items():
        os.environ.setdefault(name, value)
    if "coacd" in sys.modules and "ray" not in sys.modules:  # their C++ runtimes clash: Ray would abort the process
        raise InvalidValueError("Ray cannot start after CoACD was loaded; import ray first, at the top of the program")
    import ray

    if address and not ray.is_initialized():
        _check_answers(address)
    options: dict[str, Any] = {"address": address or "local", "logging_level": logging.ERROR, "log_to_driver": False}
    if not address:
        options |= {"num_cpus": workers, "include_dashboard": False, "object_store_memory": _OBJECT_STORE_BYTES}
    for attempts_left in (0,) if address else (1, 0):  # a busy machine may not start it within Ray's own patience
        if ray.is_initialized():
            break
        try:
            ray.init(**options)
        except Exception as error:  # noqa: BLE001  Ray raises plain exceptions, too
            ray.shutdown()
            if not attempts_left:
                raise InvalidValueError(_explain(address, error)) from None
    return ray


def _check_answers(address: str) -> None:
    """Refuse an address where nobody listens; Ray itself would go on trying for many minutes."""
    if address == "auto":
        return
    host, _, port = address.removeprefix("ray://").rpartition(":")
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_ANSWERS_WITHIN_S).close()
    except (OSError, OverflowError) as error:
        raise InvalidValueError(_explain(address, error)) from None


def _explain(address: str, error: Exception) -> str:
    detail = " ".join(str(error).split())[:200]
    if not address:
        return f"Ray does not start on this machine ({detail}); use --executor local"
    if "auth" in detail.lower():
        hint = "set RAY_AUTH_MODE=token, and copy ~/.ray/auth_token from the machine that started the cluster"
    else:
        hint = "start one there with: ray start --head --port=6379; and run this command on a machine of the cluster"
    return f"cannot join a Ray cluster at '{address}' ({detail}); {hint}"
