"""Values between processes of one run; never from a file or a stranger."""

import pickle  # noqa: TID251  what comes is what this run itself sent
from typing import Any

Payload = bytes


def encode(value: object) -> Payload:
    """A value as bytes, which pass through a Ray actor without being looked at."""
    return pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)


def decode(payload: Payload) -> Any:
    """The value of bytes that another process of this run encoded."""
    return pickle.loads(payload)  # noqa: S301
