"""Draws the pictures of the README, from the commands' own results and nothing else.

    python examples/draw_readme_pictures.py docs/images

Generates one scene of each track from built-in objects, lets the planner solve a pair of the moderate one, and draws
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
from clutter6d.render.camera import SCENE_VIEW, TABLE_VIEW
from clutter6d.render.picture import render_rollout
from clutter6d.render.scene_picture import picture_model, render_scene
from clutter6d.render.video import write_video
from clutter6d.scenegen.scene_set import SceneSet

SEED = "3"
COLOURS = 128
OBJECTS = 60


def main(out: Path) -> None:
    """Draw everything into a folder."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        for track in ("sparse", "moderate", "dense"):
            run(["generate", "--track", track, "--scenes", "1", "--seed", SEED, "--out", str(work / track)])
            draw_track(SceneSet.open(work / track), out, track)
        moderate, evaluation = work / "moderate", work / "evaluation"
        run(["evaluate", "--policy", "planner", "--scenes", str(moderate), "--pairs", "1", "--out", str(evaluation)])
        draw_solution(SceneSet.open(moderate), evaluation, out / "planner.gif")
    library = open_library("procedural")
    names = library.names()
    chosen = [names[len(names) * index // OBJECTS] for index in range(min(OBJECTS, len(names)))]
    write_palette_png(out / "objects.png", render_assets(map(library.load, chosen), columns=12, size_px=120))


def draw_track(scenes: SceneSet, out: Path, track: str) -> None:
    """A view of the table, and for the dense track the title picture."""
    scene = scenes.scenes[0]
    cameras = (SCENE_VIEW, TABLE_VIEW)
    whole, table = render_scene(scene, scenes.assets_of(scene), cameras=cameras, width=960, height=640)
    write_palette_png(out / f"{track}.png", Image.fromarray(table).resize((480, 320), Image.Resampling.LANCZOS))
    if track == "dense":
        write_palette_png(out / "dense_scene.png", Image.fromarray(whole))


def draw_solution(scenes: SceneSet, evaluation: Path, path: Path) -> None:
    """The first episode of an evaluation as an animation at four times real time."""
    motion = next(replay_motions(evaluation, scenes))
    model = picture_model(motion.scene, scenes.assets_of(motion.scene), motion.row.pair).model
    frames = render_rollout(model, motion.qpos, SCENE_VIEW, width=400, height=300)
    write_video(islice(frames, 0, None, 4), path, fps=10)


def write_palette_png(path: Path, image: Image.Image) -> None:
    """Write a picture with few colours, so that the repository stays small."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image.convert("RGB").quantize(COLOURS).save(path, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
