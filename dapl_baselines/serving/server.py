"""The inference server: one policy, many clients, a websocket (see :mod:`dapl_baselines.serving.wire`).

A client is first told what the policy needs; each of its messages is then an observation, answered by actions, or by
one line of text that says what is wrong with it. A connection is an episode.
"""

import asyncio
import http
import logging
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from jaxtyping import Float32

from clutter6d import __version__
from clutter6d.errors import Clutter6DError, InvalidValueError, MissingDependencyError
from clutter6d.physics import CONTROL_STEP_S
from dapl_baselines.serving.observation_check import check_observation, describe_fields
from dapl_baselines.serving.served_policy import Entries, ServedPolicy

try:
    from websockets.asyncio.server import Server, ServerConnection, serve
    from websockets.exceptions import ConnectionClosed
    from websockets.frames import CloseCode
    from websockets.http11 import Request, Response

    from dapl_baselines.serving.wire import MAX_MESSAGE_BYTES, WireError, pack, unpack
except ModuleNotFoundError:
    raise MissingDependencyError("serving needs websockets and msgpack: pip install 'clutter6d[serve]'") from None

MAX_CLIENTS: Final = 16
HEALTH_PATH: Final = "/healthz"
"""Answers that the server is there, to a plain HTTP request."""

_log = logging.getLogger(__name__)
_connections_log = logging.getLogger(f"{__name__}.connections")
# Whoever connects with something else than a websocket would fill the terminal with tracebacks.
_connections_log.addFilter(lambda _: logging.getLogger().isEnabledFor(logging.DEBUG))


@dataclass(frozen=True, kw_only=True, slots=True)
class Address:
    """Where the server listens; port 0 is any free one."""

    host: str
    port: int


class PolicyServer:
    """Serves a policy, one request after the other, in the order in which they come.

    Args:
        policy: What acts.
    """

    def __init__(self, policy: ServedPolicy) -> None:
        self._policy = policy
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="policy")
        self._free = list(range(MAX_CLIENTS))

    @property
    def metadata(self) -> dict[str, Any]:
        """What a client is told first."""
        return {
            "server": f"clutter6d {__version__}",
            "policy": self._policy.name,
            "policy_hash": self._policy.policy_hash,
            "observation": describe_fields(self._policy.fields),
            "actions": {"dtype": "float32", "shape": [1, 7], "unit": "rad"},
            "action_scale_rad": self._policy.action_scale_rad,
            "control_step_s": CONTROL_STEP_S,
        }

    async def listen(self, address: Address) -> Server:
        """Start to listen; close what comes back to stop.

        Browsers are refused (they name an origin), so that no web page can reach a server on its reader's machine.

        Raises:
            InvalidValueError: The port is taken, or the address is not this machine's.
        """
        try:
            return await serve(
                self._attend,
                address.host,
                address.port,
                origins=[None],
                compression=None,
                max_size=MAX_MESSAGE_BYTES,
                process_request=_answer_health,
                logger=_connections_log,
            )
        except OSError as error:
            where = f"--host {address.host} --port {address.port}"
            raise InvalidValueError(f"{where}: {error.strerror or error}; choose another, or port 0") from None

    async def _attend(self, connection: ServerConnection) -> None:
        """One client, until it leaves."""
        if not self._free:
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{MAX_CLIENTS} clients are connected; try again later")
            return
        slot = self._free.pop()
        try:
            await self._in_worker(self._policy.begin, slot)
            await connection.send(pack(self.metadata))
            async for message in connection:
                await connection.send(await self._answer(slot, message))
        except ConnectionClosed as error:
            _log.debug("a client left: %s", error)
        finally:
            self._free.append(slot)

    async def _answer(self, slot: int, message: str | bytes) -> str | bytes:
        """Actions, or one line on what is wrong."""
        try:
            observation = check_observation(unpack(message), self._policy.fields)
            start = time.perf_counter()
            action = await self._in_worker(self._act, slot, observation)
            milliseconds = 1e3 * (time.perf_counter() - start)
        except (WireError, Clutter6DError) as error:
            return f"error: {' '.join(str(error).split())}"
        return pack({"actions": action[None], "server_timing": {"infer_ms": milliseconds}})

    def _act(self, slot: int, observation: Entries) -> Float32[np.ndarray, "7"]:
        action = self._policy.act(slot, observation)
        if not np.isfinite(action).all():
            raise InvalidValueError(f"policy '{self._policy.name}' gave an action that is not finite")
        return action

    async def _in_worker(self, function: Any, *arguments: Any) -> Any:
        """Policies are asked by one thread, so that the others are not kept from answering pings."""
        return await asyncio.get_running_loop().run_in_executor(self._worker, function, *arguments)


def _answer_health(connection: ServerConnection, request: Request) -> Response | None:
    return connection.respond(http.HTTPStatus.OK, "OK\n") if request.path == HEALTH_PATH else None


async def serve_until_stopped(policy: ServedPolicy, address: Address, announce: Callable[[str], None]) -> None:
    """Serve a policy until Ctrl-C or a request to terminate; clients are told that the server goes.

    Args:
        policy: What acts.
        address: Where.
        announce: Is told where clients find the policy, once it listens.

    Raises:
        InvalidValueError: The port is taken, or the address is not this machine's.
    """
    stop = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stop.set)
    server = await PolicyServer(policy).listen(address)
    host, port = next(iter(server.sockets)).getsockname()[:2]
    announce(f"ws://{f'[{host}]' if ':' in host else host}:{port}")
    await stop.wait()
    server.close()
    await server.wait_closed()
