"""MuJoCo's own viewer, on a display that exists in memory only."""

import os
import shutil
import subprocess
import sys

import pytest

from clutter6d.errors import MissingDependencyError, UnknownNameError
from clutter6d.play.native_view import NativeView
from clutter6d.play.open_view import open_view
from clutter6d.play.web_view import WebView

SHOWS_AND_ASKS = """
import time
import numpy as np
from clutter6d.eval.builtin_policies import RandomPolicy
from clutter6d.play.native_view import NativeView
from clutter6d.play.player import Player
from clutter6d.play.playlist import live_playlist
from clutter6d.play.session import PlaySession
from tests.scene_fixtures import make_box_scene_set

policy = RandomPolicy(scale_rad=0.1, policy_hash="random")
session = PlaySession(live_playlist(make_box_scene_set(2), policy))
view = NativeView()
player = Player(session, view)
while session.frame.step < 2:
    player.tick()
picture = view._window.viewport
assert picture.width > 50 and picture.height > 50
view._keys.put(ord("P"))
player.tick()
assert view._window.user_scn.ngeom == 512 + 512 + 256
view._keys.put(267)
view._keys.put(ord("J"))
player.tick()
assert (session.selection.scene_id, session.selection.pair) == ("boxes-0", 1)
view._window.close()
while view.is_open:
    time.sleep(0.01)
player.run()
view.close()
view.close()
print("watched")
"""


@pytest.fixture
def no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)


def test_an_episode_is_played_in_a_window() -> None:
    if shutil.which("xvfb-run") is None and not os.environ.get("CI"):
        pytest.skip("no Xvfb here; on Debian: apt-get install xvfb")
    display = ["xvfb-run", "--auto-servernum", "--server-args=-screen 0 320x240x24"]
    done = subprocess.run(
        [*display, sys.executable, "-c", SHOWS_AND_ASKS], capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.returncode, done.stdout) == (0, "watched\n"), done.stderr


def test_without_a_display_the_window_says_so(no_display: None) -> None:
    with pytest.raises(MissingDependencyError, match="needs a display.*--viewer web"):
        NativeView()


def test_a_display_that_is_not_there_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":4711")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(MissingDependencyError, match="no window can be opened"):
        NativeView()


def test_without_a_display_the_page_is_chosen(no_display: None) -> None:
    view = open_view("auto")
    view.close()
    assert isinstance(view, WebView)


def test_a_viewer_that_is_not_there_is_named() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'native'"):
        open_view("nativ")
