"""A client of the inference server, for a robot's computer: needs NumPy, msgpack and websockets, and nothing else.

The messages are those of openpi: the server sends what it is (metadata), then answers each observation with actions; an
answer in text is an error. So openpi's own client works as well.
"""

from collections.abc import Mapping
from types import TracebackType
from typing import Any, cast

import numpy as np
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidMessage
from websockets.sync.client import ClientConnection, connect

from dapl_baselines.serving.wire import MAX_MESSAGE_BYTES, WireError, describe, pack, unpack


class PolicyServerError(RuntimeError):
    """The server cannot be reached, or refused an observation; says why in one line."""


class PolicyClient:
    """A connection to a policy; each connection is an episode of its own to a policy that remembers.

    Args:
        host: Where the server is.
        port: Its port.
        timeout_s: Longest wait for the connection and for each answer [s].

    Attributes:
        metadata: What the server says of its policy, among it the name, type and shape of each observation it needs.

    Raises:
        PolicyServerError: There is no server, or it speaks otherwise.
    """

    metadata: dict[str, Any]

    def __init__(self, host: str = "127.0.0.1", port: int = 8000, *, timeout_s: float = 10.0) -> None:
        self._address, self._timeout_s = f"ws://{host}:{port}", timeout_s
        self._connection = self._connect()

    def infer(self, observation: Mapping[str, Any]) -> dict[str, Any]:
        """The whole answer to an observation: ``actions`` (one row a step; here one) and ``server_timing``.

        Args:
            observation: Arrays by name, without a batch axis, as Gymnasium's environment or a ``PoseObserver`` gives
                them.

        Raises:
            PolicyServerError: The server refused it, or is gone; :meth:`reset` connects again.
        """
        try:
            self._connection.send(pack(dict(observation)))
            return _read(self._connection.recv(self._timeout_s))
        except WireError as error:
            raise PolicyServerError(f"{self._address}: {error}") from None
        except TimeoutError:
            self._connection.close()
            raise PolicyServerError(f"{self._address}: no answer within {self._timeout_s:g} s") from None
        except ConnectionClosed as error:
            raise PolicyServerError(f"{self._address}: connection closed: {_reason(error)}") from None

    def act(self, observation: Mapping[str, Any]) -> np.ndarray:
        """The joint residuals for this control step [rad], float32 ``(7,)``; errors as :meth:`infer`."""
        actions = self.infer(observation).get("actions")
        if not isinstance(actions, np.ndarray) or actions.ndim != 2:
            raise PolicyServerError(f"{self._address}: answered {describe(actions)} as actions")
        return np.array(actions[0])

    def reset(self) -> None:
        """Begin an episode: connect anew, so that a policy that remembers forgets."""
        self.close()
        self._connection = self._connect()

    def close(self) -> None:
        """End the connection."""
        self._connection.close()

    def __enter__(self) -> "PolicyClient":
        """The client itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the connection."""
        self.close()

    def _connect(self) -> ClientConnection:
        try:
            connection = connect(
                self._address, compression=None, max_size=MAX_MESSAGE_BYTES, open_timeout=self._timeout_s
            )
        except (OSError, InvalidHandshake, InvalidMessage) as error:
            raise PolicyServerError(f"{self._address}: no policy server answers: {_reason(error)}") from None
        try:
            self.metadata = _read(connection.recv(self._timeout_s))
        except (TimeoutError, WireError, ConnectionClosed) as error:
            connection.close()
            raise PolicyServerError(f"{self._address}: answers, but not as a policy server: {_reason(error)}") from None
        return connection


def _read(answer: str | bytes) -> dict[str, Any]:
    if isinstance(answer, str):
        raise WireError(answer)
    values = unpack(answer)
    if not isinstance(values, dict):
        raise WireError(f"answered {describe(values)}, expected a map")
    return cast(dict[str, Any], values)


def _reason(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
