"""A real browser: Chromium as Debian or the user installed it, drawing without a graphics card."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import Browser, expect, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@contextmanager
def open_browser() -> Iterator[Browser]:
    """Chromium; the test is skipped where there is none, but for CI."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None and not os.environ.get("CI"):
        pytest.skip("no Chromium here; on Debian: apt-get install chromium")
    expect.set_options(timeout=30_000)  # without a graphics card, on a busy machine
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path or NAMES[0], args=list(OPTIONS))
        yield browser
        browser.close()
