"""A library whose values came by rule, views that need no renderer, and an annotator for a local endpoint."""

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from clutter6d.assets.annotation.annotator import Subject
from clutter6d.assets.annotation.endpoint import Endpoint
from clutter6d.assets.annotation.endpoint_settings import EndpointSettings
from clutter6d.assets.annotation.memory import FOLDER, AnswerMemory
from clutter6d.assets.annotation.plan import ATTRIBUTES
from clutter6d.assets.annotation.vlm import VlmAnnotator
from clutter6d.assets.asset import Asset, hash_asset
from clutter6d.assets.library import AssetLibrary
from tests.assets.annotation.endpoint_server import KEY, MODEL, EndpointServer
from tests.scene_fixtures import make_box_asset


def box_by_rule(name: str, size_m: tuple[float, float, float] = (0.2, 0.1, 0.1), **origins: str) -> Asset:
    asset = make_box_asset(name, size_m, mass_kg=1.0)
    by_rule = {f"{item.removesuffix('_kg')}_from": "rule" for item in ATTRIBUTES} | origins
    asset = replace(asset, attributes=replace(asset.attributes, material="plastic", **by_rule))
    return replace(asset, content_hash=hash_asset(asset))


def picture_of(asset: Asset) -> tuple[bytes, ...]:
    """Four small pictures that differ from asset to asset."""
    buffer = io.BytesIO()
    side = np.uint8(round(1000 * asset.extents_m[0]) % 256)
    Image.fromarray(np.full((8, 8, 3), side)).save(buffer, format="PNG")
    return (buffer.getvalue(),) * 4


@pytest.fixture
def subject() -> Subject:
    asset = box_by_rule("box")
    return Subject(asset=asset, views=picture_of(asset), open=frozenset(ATTRIBUTES))


@pytest.fixture
def library(tmp_path: Path) -> AssetLibrary:
    library = AssetLibrary.create(tmp_path / "library")
    for index in range(4):
        library.add(box_by_rule(f"box-{index}", (0.2 + 0.01 * index, 0.1, 0.1)))
    return library


@pytest.fixture
def annotator_of(tmp_path: Path) -> Callable[..., VlmAnnotator]:
    def make(server: EndpointServer, folder: Path = tmp_path / "library", **settings: object) -> VlmAnnotator:
        chosen = {"model": MODEL, "base_url": server.url, "timeout_s": 5.0, "retries": 2} | settings
        endpoint = Endpoint(EndpointSettings(**chosen), key=KEY)
        return VlmAnnotator(endpoint, AnswerMemory(folder / FOLDER, MODEL))

    return make
