"""The page in a real browser: what a person sees, and what buttons and keys do."""

import io
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from clutter6d.play.live_view import Action
from clutter6d.play.player import Player
from clutter6d.play.session import PlaySession
from clutter6d.play.web_panel import WebPanel
from clutter6d.play.web_view import WebView
from tests.assets.review.browser import open_browser
from tests.play.played import STEPS, make_playlist
from tests.scene_fixtures import make_box_scene_set

EVIL = "<img src=x onerror=document.title='run'>"


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with open_browser() as browser:
        yield browser


@contextmanager
def watched_page(browser: Browser, url: str) -> Iterator[Page]:
    """A page that fails its test if a script fails or anything but the server is asked."""
    page, problems, asked = browser.new_page(viewport={"width": 700, "height": 400}), [], []
    page.set_default_timeout(60_000)
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.on("console", lambda message: problems.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto(url)
    yield page
    page.close()
    assert not [address for address in asked if not re.match(r"(http|blob:http)://127\.0\.0\.1:|data:", address)]
    assert problems == []


@contextmanager
def playing(view: WebView, player: Player) -> Iterator[None]:
    """Play beside the test, as the command does beside the browser."""
    thread = threading.Thread(target=player.run)
    thread.start()
    try:
        yield
    finally:
        view.is_open = False
        thread.join()


def says(page: Page, label: str, value: str) -> None:
    """Wait until the readout says something."""
    row = page.locator("[data-readout] tr").filter(has=page.locator("td", has_text=re.compile(f"^{label}$")))
    expect(row.locator("td").nth(1)).to_have_text(re.compile(value))


def picture(page: Page) -> np.ndarray:
    """The left half of the page: nothing but the scene."""
    clip = {"x": 10, "y": 190, "width": 350, "height": 200}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB"), dtype=np.int16)


def wait_for_picture(page: Page, is_wanted) -> np.ndarray:
    """The picture, once it is as wanted."""
    for _ in range(100):
        now = picture(page)
        if is_wanted(now):
            return now
        page.wait_for_timeout(200)
    raise AssertionError("the picture is not as wanted")


def is_brown(image: np.ndarray) -> np.ndarray:
    return (image[..., 0] > image[..., 2] + 45) & (image[..., 0] > image[..., 1] + 15)


def is_ghostly(image: np.ndarray) -> np.ndarray:
    return (image[..., 1] > image[..., 0] + 30) & (image[..., 1] > image[..., 2] + 20)


def is_marked(image: np.ndarray) -> np.ndarray:
    return (image[..., 2] > image[..., 0] + 80) & (image[..., 2] > image[..., 1] + 40)


@pytest.fixture
def view() -> Iterator[WebView]:
    view = WebView()
    yield view
    view.close()


def test_a_person_watches_steps_and_chooses(browser: Browser, view: WebView) -> None:
    session = PlaySession(make_playlist(), ("boxes-0", 1))
    player = Player(session, view, is_paused=True)
    player.panel = WebPanel(view, session)
    with playing(view, player), watched_page(browser, view.url) as page:
        says(page, "scene", "^boxes-0$")
        says(page, "step", f"^0 of {STEPS}")
        seen = wait_for_picture(page, lambda image: is_brown(image).mean() > 0.005 and is_ghostly(image).mean() > 0.002)

        page.get_by_role("button", name="Step", exact=True).click()
        says(page, "step", f"^1 of {STEPS}")
        page.keyboard.press("b")
        says(page, "step", f"^0 of {STEPS}")

        page.get_by_role("button", name="Policy's points").click()
        wait_for_picture(page, lambda image: is_marked(image).mean() > 0.001)
        page.keyboard.press("p")
        wait_for_picture(page, lambda image: is_marked(image).mean() == 0)

        page.get_by_role("button", name="Play / pause").click()
        says(page, "outcome", "^drop$")
        moved = picture(page)
        assert (np.abs(moved - seen).max(axis=-1) > 30).mean() > 0.002

        page.get_by_role("button", name="Next").click()
        says(page, "scene", "^boxes-1$")
        says(page, "pair", "^0 ")
        page.get_by_role("button", name="Previous").click()
        says(page, "scene", "^boxes-0$")

        page.get_by_role("combobox", name="Scene").click()
        page.get_by_role("option", name="boxes-2").click()
        says(page, "scene", "^boxes-2$")

        before = picture(page)
        page.get_by_role("button", name="table", exact=True).click()
        wait_for_picture(page, lambda image: (np.abs(image - before).max(axis=-1) > 30).mean() > 0.05)


def test_any_program_can_show_a_scene_and_ask_for_keys(browser: Browser, view: WebView) -> None:
    made = make_box_scene_set(1)
    view.offer([Action(name="left", label="Left", key="J"), Action(name="stop", label="Stop", key="space")])
    view.show(made.scenes[0], made.assets_of(made.scenes[0]))
    view.message(f"driver\t{EVIL}\n{{1+1}}")
    with watched_page(browser, view.url) as page:
        expect(page.locator("[data-readout]")).to_contain_text(EVIL)
        expect(page.locator("[data-readout]")).to_contain_text("{1+1}")
        page.keyboard.press("j")
        page.keyboard.press("Space")
        page.get_by_role("button", name="Left").click()
        asked: tuple[str, ...] = ()
        for _ in range(50):
            asked += view.triggered()
            if len(asked) == 3:
                break
            page.wait_for_timeout(100)
        assert asked == ("left", "stop", "left")
        assert page.title() != "run"
