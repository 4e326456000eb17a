"""The page as it is shipped: built from the sources that are here, small, and complete without the network."""

import hashlib
import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

from clutter6d.assets.review.page_files import PAGE_FILES, page_file

SOURCES = Path(__file__).resolve().parents[3] / "web" / "review"
MAX_BUNDLE_BYTES = 800_000


def test_the_page_was_built_from_these_sources() -> None:
    names = ["package-lock.json", "build.mjs", *(f"public/{path.name}" for path in (SOURCES / "public").iterdir())]
    names += [f"src/{path.name}" for path in (SOURCES / "src").iterdir()]
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(f"{name}\n".encode() + (SOURCES / name).read_bytes())
    assert (SOURCES / "built-from.sha256").read_text().strip() == digest.hexdigest(), "run: make web"


def test_every_file_is_served_and_nothing_is_left_over() -> None:
    shipped = {path.name for path in files("clutter6d.assets.review").joinpath("static").iterdir()}
    assert shipped == {name for name, _ in PAGE_FILES.values()}


def test_the_bundle_is_small() -> None:
    assert len(page_file("review.js")) < MAX_BUNDLE_BYTES


def test_the_licence_of_what_is_bundled_comes_along() -> None:
    notice = page_file("THIRD_PARTY.txt").decode()
    version = json.loads((SOURCES / "package.json").read_text())["dependencies"]["three"]
    assert f"three.js {version}" in notice
    assert "MIT License" in notice
    assert b"THIRD_PARTY.txt" in page_file("review.js")[:200]


@pytest.mark.parametrize("name", ["index.html", "review.css"])
def test_the_page_names_no_other_address(name: str) -> None:
    assert not re.search(rb"""(src|href|url|import)\s*[=(]?\s*["']?\s*(https?:)?//""", page_file(name))


def test_nothing_is_inline_in_the_page() -> None:
    page = page_file("index.html").decode()
    assert not re.search(r"<script(?![^>]*\bsrc=)|<style|\sstyle=|\son\w+=", page)


def test_the_lock_file_names_no_registry() -> None:
    assert "resolved" not in (SOURCES / "package-lock.json").read_text()
