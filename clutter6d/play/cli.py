"""The command ``clutter6d play``."""

import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from clutter6d.dataset.scenes import find_scenes, open_scenes
from clutter6d.errors import InvalidValueError, MissingFileError
from clutter6d.eval.cli import SCENES_FILE, ScenesLocation
from clutter6d.eval.evaluator import REPORT_FILE
from clutter6d.eval.policy import PolicyOptions
from clutter6d.eval.policy_loading import load_policy
from clutter6d.play.open_view import open_view
from clutter6d.play.player import Player
from clutter6d.play.playlist import Playlist, live_playlist, recorded_playlist
from clutter6d.play.session import PlaySession
from clutter6d.play.web_panel import WebPanel
from clutter6d.play.web_view import WebView
from clutter6d.schema import read_model


def play(
    evaluation: Annotated[Path | None, typer.Argument(help="What clutter6d evaluate wrote, to look through.")] = None,
    policy: Annotated[
        str | None, typer.Option(help="zero, random, planner, package.module:factory, or a .pt checkpoint.")
    ] = None,
    scenes: Annotated[
        str | None, typer.Option(help="A frozen split, a folder of scenes, or SPLIT/SCENE; default sparse-test.")
    ] = None,
    scene: Annotated[str | None, typer.Option(help="Id of the scene to begin with; default the first.")] = None,
    pair: Annotated[int | None, typer.Option(min=0, help="Goal pair to begin with; default the first.")] = None,
    seed: Annotated[int, typer.Option(help="Seed of everything the policy draws.")] = 0,
    viewer: Annotated[str, typer.Option(help="web, native, or auto: native where there is a display.")] = "auto",
    host: Annotated[str, typer.Option(help="Address of the page; other than this machine's lets others in.")] = (
        "127.0.0.1"
    ),
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port of the page; 0 for any free one.")] = 0,
    paused: Annotated[bool, typer.Option("--paused", help="Wait with the first step until you press play.")] = False,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the page's address.")] = False,
) -> None:
    """Watch a policy act, or look through an evaluation, in the browser or MuJoCo's viewer; stop with Ctrl+C."""
    console = Console(markup=False, emoji=False, soft_wrap=True, highlight=False)
    playlist = _playlist(evaluation, policy, scenes, seed)
    session = PlaySession(playlist, _start(playlist, scene, pair))
    view = open_view(viewer, host=host, port=port)
    try:
        player = Player(session, view, is_paused=paused)
        if isinstance(view, WebView):
            player.panel = WebPanel(view, session)
            console.print(f"viewer: {view.url}   (stop with Ctrl+C)")
            if not no_browser:
                threading.Thread(target=webbrowser.open, args=(view.url,), daemon=True).start()
        player.run()
    finally:
        view.close()


def _playlist(evaluation: Path | None, policy: str | None, scenes: str | None, seed: int) -> Playlist:
    """What the arguments mean: a recorded evaluation, or a policy on scenes."""
    if (evaluation is None) == (policy is None):
        raise InvalidValueError("give either the folder of an evaluation or --policy, to say what is to be played")
    if policy is not None:
        found, only = find_scenes(scenes or "sparse-test")
        loaded = load_policy(policy, PolicyOptions(seed=seed))
        return live_playlist(found, loaded, only=[item.scene_id for item in only], seed=seed)
    assert evaluation is not None
    if not (evaluation / REPORT_FILE).is_file():
        raise MissingFileError("finished evaluation", evaluation, "make one with: clutter6d evaluate")
    where = scenes or read_model(evaluation / SCENES_FILE, ScenesLocation, what="scenes of the evaluation").scenes
    return recorded_playlist(evaluation, open_scenes(where))


def _start(playlist: Playlist, scene: str | None, pair: int | None) -> tuple[str, int] | None:
    """The episode to begin with, if one is named."""
    if scene is None and pair is None:
        return None
    scene_id = scene or playlist.keys[0][0]
    first = next((number for name, number in playlist.keys if name == scene_id), 0)
    return scene_id, first if pair is None else pair
