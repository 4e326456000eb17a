"""Processed assets that several test files look at; made once."""

import pytest
import trimesh

from clutter6d.assets.asset import Asset
from clutter6d.assets.processing import ProcessingSettings, process_object
from clutter6d.assets.sources.base import RawShape, SourceObject
from tests.assets.mesh_files import as_shape, l_bracket, source_object


class ShapeSource:
    """Objects given as shapes."""

    name = "shapes"

    def __init__(self, shapes: dict[str, RawShape]) -> None:
        self.shapes = shapes

    def objects(self) -> tuple[SourceObject, ...]:
        return tuple(source_object(key) for key in self.shapes)

    def fingerprint(self, item: SourceObject) -> str:
        return item.key

    def load(self, item: SourceObject) -> RawShape:
        return self.shapes[item.key]


def process(shape: RawShape, **changes: object) -> Asset:
    item = source_object(**changes)
    return process_object(ShapeSource({item.key: shape}), item, ProcessingSettings())


@pytest.fixture(scope="session")
def brick() -> Asset:
    return process(as_shape(trimesh.creation.box((0.12, 0.08, 0.04))), name="brick")


@pytest.fixture(scope="session")
def bracket() -> Asset:
    return process(as_shape(l_bracket()), name="bracket")
