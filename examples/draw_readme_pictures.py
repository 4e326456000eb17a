"""Draws the pictures of the README, from the commands' own results and nothing else.

    python examples/draw_readme_pictures.py docs/images

Generates one scene of each track from built-in objects, lets the planner solve a pair of the sparse one, and draws
them all.
"""

import sys
import tempfile
from itertools import islice
from pathlib import Path

from PIL import Image

from clutter6d.assets.named_libraries import open_library
from clutter6d.cli import run
from clutter6d.eval.motion import replay_motions
from clutter6d.render.asset_picture import render_assets
from clutter6d.render.camera import EPISODE_VIEW, SCENE_VIEW, TABLE_VIEW
from clutter6d.render.picture import render_rollout
from clutter6d.render.scene_picture import picture_model, render_scene
from clutter6d.render.sheet import write_image
from clutter6d.render.video import write_video
from clutter6d.scenegen.scene_set import SceneSet

FIRST = {"sparse": "5", "moderate": "6", "dense": "6"}
"""Scenes of seed 0 in which nothing hides the goal."""
OBJECTS = 60


def main(out: Path) -> None:
    """Draw everything into a folder."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for track in ("sparse", "moderate", "dense"):
            run(["generate", "--track", track, "--scenes", "1", "--first", FIRST[track], "--out", str(work / track)])
            draw_track(SceneSet.open(work / track), out, track)
        sparse, evaluation = work / "sparse", work / "evaluation"
        run(["evaluate", "--policy", "planner", "--scenes", str(sparse), "--pairs", "1", "--out", str(evaluation)])
        draw_solution(SceneSet.open(sparse), evaluation, out / "planner.gif")
    library = open_library("procedural")
    names = library.names()
    chosen = [names[len(names) * index // OBJECTS] for index in range(min(OBJECTS, len(names)))]
    write_image(out / "objects.png", render_assets(map(library.load, chosen), columns=10, size_px=110))


def draw_track(scenes: SceneSet, out: Path, track: str) -> None:
    """A view of the table, and for the dense track the title picture."""
    scene = scenes.scenes[0]
    cameras = (SCENE_VIEW, TABLE_VIEW)
    whole, table = render_scene(scene, scenes.assets_of(scene), cameras=cameras, width=960, height=640)
    write_image(out / f"{track}.png", Image.fromarray(table).resize((480, 320), Image.Resampling.LANCZOS))
    if track == "dense":
        write_image(out / "dense_scene.png", whole)


def draw_solution(scenes: SceneSet, evaluation: Path, path: Path) -> None:
    """The first episode of an evaluation as an animation at four times real time."""
    motion = next(replay_motions(evaluation, scenes))
    model = picture_model(motion.scene, scenes.assets_of(motion.scene), motion.row.pair).model
    frames = render_rollout(model, motion.qpos, EPISODE_VIEW, width=400, height=300)
    write_video(islice(frames, 0, None, 4), path, fps=10)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
