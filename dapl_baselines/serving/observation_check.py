"""An observation that came from elsewhere: every name, type, shape and number is looked at before it is used."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from jaxtyping import Float32

from clutter6d.envs.observation import OBSERVATION_SHAPES
from dapl_baselines.serving.wire import WireError, describe


def describe_fields(fields: Sequence[str]) -> dict[str, Any]:
    """What a policy needs, for a client to read."""
    return {name: {"dtype": "float32", "shape": list(OBSERVATION_SHAPES[name])} for name in fields}


def check_observation(value: object, fields: Sequence[str]) -> dict[str, Float32[np.ndarray, "..."]]:
    """The entries of an observation that a policy needs, without a batch axis.

    Others that an observation has may come as well, so that a client need not know what a policy looks at.

    Raises:
        WireError: An entry is missing, unknown, of another type or shape, or not finite.
    """
    if not isinstance(value, dict):
        raise WireError(f"the message holds {describe(value)}; expected a map of arrays by name")
    entries = cast(dict[object, object], value)
    unknown = [name for name in entries if name not in OBSERVATION_SHAPES]
    if unknown:
        raise WireError(f"unknown entry {str(unknown[0])[:60]!r} (known: {', '.join(OBSERVATION_SHAPES)})")
    missing = [name for name in fields if name not in entries]
    if missing:
        raise WireError(f"entry '{missing[0]}' is missing (needed: {', '.join(fields)})")
    return {name: _check_entry(name, entries[name]) for name in fields}


def _check_entry(name: str, array: object) -> Float32[np.ndarray, "..."]:
    wanted = OBSERVATION_SHAPES[name]
    if not isinstance(array, np.ndarray) or array.dtype != np.float32 or array.shape != wanted:
        raise WireError(f"entry '{name}' is {describe(array)}, expected float32{wanted}")
    if not np.isfinite(array).all():
        raise WireError(f"entry '{name}' holds values that are not finite")
    return array
