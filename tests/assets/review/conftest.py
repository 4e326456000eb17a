"""A library of boxes under review, and a server of its page."""

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.server import ReviewServer
from clutter6d.assets.review.session import ReviewSession
from tests.box_library import make_box_library


@pytest.fixture
def library(tmp_path: Path) -> AssetLibrary:
    return make_box_library(tmp_path / "library", large=1, small=3)


@pytest.fixture
def session(library: AssetLibrary) -> ReviewSession:
    return ReviewSession(library, "ada")


@pytest.fixture
def server(session: ReviewSession) -> Iterator[ReviewServer]:
    with ReviewServer(session) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def hash_of(library: AssetLibrary, name: str) -> str:
    return AssetLibrary.open(library.path).describe(name).content_hash
