"""Draws what the three default cameras of an environment give: colour, depth and segmentation.

python examples/draw_cameras.py docs/images/cameras.png
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32, UInt8

from clutter6d import load_split
from clutter6d.envs.cameras import CAMERA_KINDS, DEFAULT_CAMERAS, CameraRig
from clutter6d.render.sheet import contact_sheet, write_image
from clutter6d.sim.scene_model import compile_stored_scene, joint_state

SPLIT, SCENE, PAIR = "moderate-test", 3, 0
WIDTH, HEIGHT = 320, 240
NEAR_M, FAR_M = 0.6, 1.8
COLOURS = np.array(
    [(235, 235, 238), (214, 202, 186), (120, 128, 140), (214, 39, 40), (31, 119, 180), (44, 160, 44), (148, 103, 189),
     (255, 127, 14), (23, 190, 207), (227, 119, 194), (188, 189, 34), (140, 86, 75)],
    dtype=np.uint8,
)  # fmt: skip
"""Of the labels: background, table, robot, target, obstacles."""


def main(path: Path) -> None:
    """Draw one start of one scene, a row for each camera."""
    scenes = load_split(SPLIT)
    scene = scenes.scenes[SCENE]
    model = compile_stored_scene(scene, scenes.assets_of(scene))
    cameras = [replace(camera, width=WIDTH, height=HEIGHT) for camera in DEFAULT_CAMERAS]
    with CameraRig(cameras) as rig:
        seen = rig.observe([model], joint_state(scene.goal_pairs[PAIR].object_poses)[None])
    as_colours = {"rgb": np.asarray, "depth": grey, "segmentation": COLOURS.__getitem__}
    names = [(camera.name, kind) for camera in cameras for kind in CAMERA_KINDS]
    pictures = [as_colours[kind](seen[f"camera_{name}_{kind}"][0]) for name, kind in names]
    write_image(path, contact_sheet(pictures, [f"camera_{name}_{kind}" for name, kind in names], len(CAMERA_KINDS)))


def grey(depth_m: Float32[np.ndarray, "height width"]) -> UInt8[np.ndarray, "height width 3"]:
    """Near is dark, far is light, nothing is white."""
    share = np.clip((depth_m - NEAR_M) / (FAR_M - NEAR_M), 0, 0.95)
    share[depth_m == 0] = 1
    return np.repeat(np.rint(255 * share).astype(np.uint8)[..., None], 3, axis=-1)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
