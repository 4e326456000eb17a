"""A source whose objects do to the process what real meshes have done."""

import os
import time

import numpy as np
import trimesh

from clutter6d.assets.sources.base import RawShape, SourceObject
from tests.assets.mesh_files import as_shape, source_object

KINDS = ("good", "aborts", "hangs", "eats-memory", "raises")


class MisbehavingSource:
    name = "misbehaving"

    def objects(self) -> tuple[SourceObject, ...]:
        return tuple(source_object(kind) for kind in KINDS)

    def fingerprint(self, item: SourceObject) -> str:
        return item.key

    def load(self, item: SourceObject) -> RawShape:
        match item.key:
            case "aborts":
                os.abort()
            case "hangs":
                _spin()
            case "eats-memory":
                np.ones((1 << 40,), dtype=np.uint8)
            case "raises":
                raise ZeroDivisionError("in the loader")
        return as_shape(trimesh.creation.box((0.1, 0.06, 0.04)))


def _spin() -> None:
    end = time.monotonic() + 60
    while time.monotonic() < end:
        pass


def square(value: int) -> int:
    return value * value


def misbehave(kind: str) -> str:
    MisbehavingSource().load(source_object(kind))
    return kind
