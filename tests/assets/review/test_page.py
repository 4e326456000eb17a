"""The page in a real browser: what a reviewer sees, and what keys do."""

import io
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from clutter6d.assets.asset import hash_asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.server import ReviewServer
from clutter6d.assets.review.session import ReviewSession
from tests.assets.review.browser import open_browser
from tests.box_library import make_box_library
from tests.scene_fixtures import make_box_asset

COMMAND = (sys.executable, "-c", "from clutter6d.cli import main; main()", "assets", "review", "--no-browser")
EVIL = "<script>document.title='run'</script>"
EVIL_IMAGE = "<img src=x onerror=document.title='run'>"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with open_browser() as browser:
        yield browser


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page of a reviewer who prefers that nothing moves, so that the test need not draw all the time."""
    with watched_page(browser, reduced_motion="reduce") as page:
        yield page


@contextmanager
def watched_page(browser: Browser, **options: str) -> Iterator[Page]:
    """A page that fails its test if a script fails or anything but the server is asked."""
    context = browser.new_context(viewport={"width": 1000, "height": 640}, **options)
    page, problems, asked = context.new_page(), [], []
    page.set_default_timeout(60_000)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    yield page
    context.close()
    assert not [url for url in asked if not url.startswith("http://127.0.0.1:")]
    assert not [problem for problem in problems if "Failed to load resource" not in problem]


def open_page(page: Page, server: ReviewServer, name: str = "box-000") -> None:
    page.goto(server.url)
    expect(page.locator("#details h1")).to_have_text(name)


def decisions(library: AssetLibrary) -> list[tuple[str, str]]:
    return [(entry.decision, entry.asset_name) for entry in ReviewJournal(library.path).entries()]


def picture(page: Page) -> np.ndarray:
    """The middle of the canvas."""
    box = page.locator("#canvas").bounding_box()
    assert box is not None
    clip = {"x": box["x"] + 60, "y": box["y"] + 110, "width": box["width"] - 120, "height": box["height"] - 200}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB"), dtype=np.int16)


def wait_until_other_than(page: Page, before: np.ndarray) -> np.ndarray:
    """The picture, once a hundredth of it differs."""
    for _ in range(100):
        now = picture(page)
        if (np.abs(now - before).max(axis=-1) > 30).mean() > 0.01:
            return now
        page.wait_for_timeout(100)
    raise AssertionError("the picture does not change")


def wait_until_still(page: Page) -> np.ndarray:
    before = picture(page)
    for _ in range(100):
        page.wait_for_timeout(150)
        now = picture(page)
        if np.array_equal(now, before):
            return now
        before = now
    raise AssertionError("the picture keeps changing")


def test_the_asset_is_seen_and_turns(browser: Browser, server: ReviewServer) -> None:
    with watched_page(browser, reduced_motion="no-preference") as page:
        open_page(page, server)
        empty = np.zeros_like(picture(page))
        first = wait_until_other_than(page, empty)
        wait_until_other_than(page, first)
        page.keyboard.press("Space")
        still = wait_until_still(page)
        brown = (still[..., 0] > still[..., 2] + 30).mean()
        assert brown > 0.05


def test_parts_and_poses_are_shown(page: Page, server: ReviewServer) -> None:
    open_page(page, server)
    whole = wait_until_still(page)
    page.keyboard.press("2")
    expect(page.locator("#caption")).to_have_text("1 convex part")
    wait_until_other_than(page, whole)
    page.keyboard.press("4")
    expect(page.locator("#caption")).to_have_text("Pose 1 of 3 · 33% of drops")
    lying = wait_until_still(page)
    page.keyboard.press("]")
    expect(page.locator("#caption")).to_have_text("Pose 2 of 3 · 33% of drops")
    wait_until_other_than(page, lying)
    page.keyboard.press("[")
    page.keyboard.press("[")
    expect(page.locator("#caption")).to_have_text("Pose 3 of 3 · 33% of drops")


def test_a_review_by_keyboard(page: Page, server: ReviewServer, library: AssetLibrary) -> None:
    open_page(page, server)
    before = {name: library.describe(name).content_hash for name in library.names()}

    page.keyboard.press("a")
    expect(page.locator("#details h1")).to_have_text("box-001")
    expect(page.locator("#progress-text")).to_have_text("1 of 4")

    page.keyboard.press("e")
    page.fill("#edit-mass_kg", "1,25")
    page.keyboard.press("Enter")
    mass = page.locator("[data-field=mass_kg]")
    expect(mass.locator(".value")).to_have_text("1.25 kg")
    expect(mass.locator(".from")).to_have_text("person")
    expect(page.locator(".badge")).to_have_text("Edited by ada")
    edited = AssetLibrary.open(library.path).load("box-001")
    assert (edited.mass_properties.mass_kg, edited.attributes.mass_from) == (1.25, "person")

    page.keyboard.press("n")
    expect(page.locator("#details h1")).to_have_text("box-002")
    page.keyboard.press("r")
    page.keyboard.press("2")
    expect(page.locator("#details h1")).to_have_text("box-003")
    assert ReviewJournal(library.path).entries()[-1].reason == "convex parts do not fit"
    assert "box-002" not in library.names()

    page.keyboard.press("r")
    page.fill("#reason", "<b>a crack</b> at z=2")
    page.keyboard.press("Enter")
    expect(page.locator("#progress-text")).to_have_text("4 of 4")
    assert decisions(library) == [
        ("accept", "box-000"), ("edit", "box-001"), ("reject", "box-002"), ("reject", "box-003")
    ]  # fmt: skip

    page.reload()
    expect(page.locator("#progress-text")).to_have_text("4 of 4")
    for left in (3, 2, 1, 0):
        page.keyboard.press("u")
        expect(page.locator("#progress-text")).to_have_text(f"{left} of 4")
    expect(page.locator("#undo")).to_be_disabled()
    opened = AssetLibrary.open(library.path)
    assert {name: opened.load(name).content_hash for name in opened.names()} == before


def test_a_wrong_value_is_refused_and_nothing_changes(page: Page, server: ReviewServer, library: AssetLibrary) -> None:
    open_page(page, server)
    page.keyboard.press("e")
    page.fill("#edit-mass_kg", "-3")
    page.keyboard.press("Enter")
    assert page.evaluate("document.querySelector('#edit-mass_kg').validity.patternMismatch")
    page.fill("#edit-mass_kg", "900")
    page.keyboard.press("Enter")
    expect(page.locator("#status")).to_contain_text("at most 50")
    assert decisions(library) == []


def test_finding_and_filtering(page: Page, server: ReviewServer) -> None:
    open_page(page, server)
    page.keyboard.press("/")
    page.keyboard.type("003")
    expect(page.locator("#rows li")).to_have_count(1)
    page.keyboard.press("Enter")
    expect(page.locator("#details h1")).to_have_text("box-003")
    page.keyboard.press("a")
    page.fill("#search", "")
    page.click("[data-filter=accept]")
    expect(page.locator("#rows .name")).to_have_text(["box-003"])
    page.click("[data-filter=open]")
    expect(page.locator("#rows .name")).to_have_text(["box-000", "box-001", "box-002"])


def test_keys_are_explained_and_text_fields_keep_theirs(
    page: Page, server: ReviewServer, library: AssetLibrary
) -> None:
    open_page(page, server)
    page.keyboard.press("?")
    expect(page.locator("#help")).to_be_visible()
    expect(page.locator("#keys")).to_contain_text("Undo your last decision")
    page.keyboard.press("a")
    page.keyboard.press("Escape")
    expect(page.locator("#help")).to_be_hidden()
    page.fill("#search", "")
    page.locator("#search").press("a")
    assert decisions(library) == []


def test_two_tabs_know_of_each_other(page: Page, server: ReviewServer, library: AssetLibrary) -> None:
    open_page(page, server)
    other = page.context.new_page()
    open_page(other, server)
    page.keyboard.press("e")
    page.fill("#edit-colour", "red")
    page.keyboard.press("Enter")
    expect(page.locator(".badge")).to_have_text("Edited by ada")
    other.keyboard.press("a")
    expect(other.locator("#status")).to_contain_text("may have been changed since")
    expect(other.locator("[data-field=colour] .value")).to_have_text("red")
    assert decisions(library) == [("edit", "box-000")]
    other.close()


def test_text_of_an_asset_is_never_markup(page: Page, tmp_path: Path) -> None:
    asset = make_box_asset("box-000", (0.1, 0.1, 0.1))
    asset = replace(
        asset,
        attributes=replace(asset.attributes, category=EVIL, colour=EVIL_IMAGE),
        licence=replace(asset.licence, author=EVIL_IMAGE, source_id=EVIL, url="javascript:alert(1)"),
        quality=replace(asset.quality, fallbacks=(EVIL_IMAGE,)),
    )
    library = AssetLibrary.create(tmp_path / "library")
    library.add(replace(asset, content_hash=hash_asset(asset)))
    session = ReviewSession(library, EVIL)
    session.decide(library.describe("box-000").content_hash, "reject", reason=EVIL_IMAGE)
    with ReviewServer(session) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        open_page(page, server)
        expect(page.locator("[data-field=category] .value")).to_have_text(EVIL)
        expect(page.locator("#details")).to_contain_text(EVIL_IMAGE)
        expect(page.locator("#reviewer")).to_have_text(EVIL)
        page.keyboard.press("e")
        expect(page.locator("#edit-colour")).to_have_value(EVIL_IMAGE)
        assert page.title() == "Review of library"
        assert page.locator("#details img, #details a, #details script").count() == 0
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (420, 900)])
def test_everything_fits(page: Page, server: ReviewServer, width: int, height: int) -> None:
    page.set_viewport_size({"width": width, "height": height})
    open_page(page, server)
    for selector in ("#canvas", "#details h1", "#accept", "#reject", "#undo", "#progress-text"):
        box = page.locator(selector).bounding_box()
        assert box is not None, selector
        assert box["x"] >= 0, selector
        assert box["x"] + box["width"] <= width, selector
        assert box["y"] + box["height"] <= height, selector
    assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_controls_have_names_and_are_reached_by_keyboard(page: Page, server: ReviewServer) -> None:
    open_page(page, server)
    names = page.evaluate("""[...document.querySelectorAll('button, input')]
        .filter((item) => item.offsetParent)
        .map((item) => item.getAttribute('aria-label') || item.labels?.[0]?.textContent || item.textContent.trim())""")
    assert len(names) > 10
    assert all(names)
    page.keyboard.press("Tab")
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"


def start_server(library: Path) -> tuple[subprocess.Popen[str], str]:
    process = subprocess.Popen(
        [*COMMAND, str(library), "--reviewer", "ada"],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "200"},
    )
    assert process.stdout is not None
    return process, process.stdout.readline().split()[-1]


def test_a_killed_server_loses_nothing(page: Page, tmp_path: Path) -> None:
    library = make_box_library(tmp_path / "library", large=1, small=2)
    process, url = start_server(library.path)
    page.goto(url)
    expect(page.locator("#details h1")).to_have_text("box-000")
    page.keyboard.press("a")
    expect(page.locator("#details h1")).to_have_text("box-001")
    process.send_signal(signal.SIGKILL)
    process.communicate()
    page.keyboard.press("a")
    expect(page.locator("#offline")).to_be_visible()
    expect(page.locator("#progress-text")).to_have_text("1 of 3")
    with ReviewJournal(library.path).path.open("ab") as journal:
        journal.write(b'{"schema_version":1,"entry_')
    process, url = start_server(library.path)
    try:
        page.goto(url)
        expect(page.locator("#details h1")).to_have_text("box-001")
        expect(page.locator("#progress-text")).to_have_text("1 of 3")
        page.keyboard.press("a")
        expect(page.locator("#progress-text")).to_have_text("2 of 3")
        assert decisions(library) == [("accept", "box-000"), ("accept", "box-001")]
    finally:
        process.kill()
        process.communicate()
