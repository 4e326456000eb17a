"""A source whose object makes CoACD abort the process, as it can; only its hull survives."""

import os

import coacd

from clutter6d.assets.sources.base import RawShape, SourceObject
from tests.assets.mesh_files import as_shape, l_bracket, source_object


class SelfDestructingSource:
    name = "self-destructing"

    def objects(self) -> tuple[SourceObject, ...]:
        return (source_object("bracket"),)

    def fingerprint(self, item: SourceObject) -> str:
        return item.key

    def load(self, item: SourceObject) -> RawShape:
        coacd.run_coacd = _abort
        return as_shape(l_bracket())


def _abort(*arguments: object, **options: object) -> None:
    os.abort()
