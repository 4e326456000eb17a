"""Pictures of scenes and assets, and the commands that make them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from clutter6d.cli import run
from clutter6d.errors import InvalidValueError
from clutter6d.render.asset_picture import render_assets
from clutter6d.render.scene_picture import GHOST_RGBA, picture_model, render_scene, render_turn
from clutter6d.render.studio import GHOST_GROUP
from clutter6d.scenegen.scene_set import GenerationRecord, SceneSet, SceneSetFile
from clutter6d.sim.scene_model import joint_state
from tests.scene_fixtures import make_box_asset, make_box_scene_set

SMALL = {"width": 80, "height": 60, "backend": "raycast"}


@pytest.fixture(scope="module")
def stored_set(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("scenes") / "set"
    boxes = make_box_scene_set(2)
    header = SceneSetFile(track="sparse", seed=0, library_sha256="0" * 64, generator_version="test")
    scene_set = SceneSet.create(path, header)
    for scene in boxes.scenes:
        scene_set.add(scene, boxes.assets_of(scene), GenerationRecord(failures={}, seconds=0.0))
    return path


def green(image: np.ndarray) -> int:
    colour = image.astype(int)
    return int((colour[..., 1] - colour[..., [0, 2]].max(axis=-1) > 25).sum())


def test_the_goal_is_a_ghost_that_neither_collides_nor_weighs():
    boxes = make_box_scene_set(1)
    scene = boxes.scenes[0]
    model = picture_model(scene, boxes.assets_of(scene), pair=1).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    body = model.body("target_goal")
    np.testing.assert_allclose(data.xpos[body.id], scene.goal_pairs[1].goal.position, atol=1e-9)
    geoms = range(body.geomadr[0], body.geomadr[0] + body.geomnum[0])
    assert body.mass[0] == 0
    assert all(model.geom_group[i] == GHOST_GROUP for i in geoms)
    assert not model.geom_contype[list(geoms)].any()
    np.testing.assert_allclose(model.geom_rgba[list(geoms)], [GHOST_RGBA] * len(geoms), atol=1e-6)


def test_a_still_shows_the_ghost_in_green():
    boxes = make_box_scene_set(1)
    scene = boxes.scenes[0]
    overview, table = render_scene(scene, boxes.assets_of(scene), **SMALL)
    assert table.shape == overview.shape == (60, 80, 3)
    assert green(table) > 20


def test_pairs_differ_and_a_missing_pair_is_refused():
    boxes = make_box_scene_set(1)
    scene = boxes.scenes[0]
    first, second = (render_scene(scene, boxes.assets_of(scene), pair, **SMALL)[1] for pair in (0, 1))
    assert not np.array_equal(first, second)
    with pytest.raises(InvalidValueError, match="0 to 1, not 2"):
        picture_model(scene, boxes.assets_of(scene), pair=2)


def test_a_recorded_configuration_fits_the_picture_model():
    boxes = make_box_scene_set(1)
    scene = boxes.scenes[0]
    shown = picture_model(scene, boxes.assets_of(scene))
    assert np.array_equal(shown.initial_qpos, joint_state(scene.goal_pairs[0].object_poses))
    assert shown.model.nq == len(shown.initial_qpos)


def test_a_turn_ends_where_it_began():
    boxes = make_box_scene_set(1)
    scene = boxes.scenes[0]
    frames = list(render_turn(scene, boxes.assets_of(scene), frames=4, **SMALL))
    assert len(frames) == 4
    assert not np.array_equal(frames[0], frames[2])
    assert np.array_equal(frames[1], frames[3]), "to and fro"


def test_assets_fill_their_pictures_whatever_their_size():
    assets = [make_box_asset(f"box-{size}", (size, size / 2, size / 2)) for size in (0.06, 0.30)]
    sheet = np.array(render_assets(assets, columns=2, size_px=64, backend="raycast")).astype(int)
    brown = (sheet[..., 0] - sheet[..., 2]) > 40
    left, right = brown[:, : sheet.shape[1] // 2].sum(), brown[:, sheet.shape[1] // 2 :].sum()
    assert left == pytest.approx(right, rel=0.15)
    assert left > 0.12 * 64 * 64


def test_render_writes_stills_and_a_contact_sheet(stored_set, tmp_path, capsys):
    out = tmp_path / "pictures"
    arguments = ["--out", str(out), "--width", "80", "--height", "60", "--backend", "raycast"]
    assert run(["render", str(stored_set), *arguments]) == 0
    names = {path.name for path in out.iterdir()}
    stills = {f"boxes-{i}_{view}.png" for i in range(2) for view in ("scene", "table")}
    assert names == stills | {"contact_sheet.png"}
    with Image.open(out / "boxes-0_scene.png") as picture:
        assert picture.size == (80, 60)
    assert "drew 2 scenes" in capsys.readouterr().out


def test_render_draws_one_scene_of_a_set_and_a_video(stored_set, tmp_path):
    arguments = ["--out", str(tmp_path), "--width", "48", "--height", "32", "--backend", "raycast", "--video"]
    assert run(["render", str(stored_set / "scenes" / "boxes-1"), *arguments]) == 0
    assert {path.name for path in tmp_path.iterdir()} == {
        "boxes-1.mp4",
        "boxes-1_scene.png",
        "boxes-1_table.png",
        "contact_sheet.png",
    }


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["render", "no-such-folder"], "unknown folder of scenes or split 'no-such-folder'"),
        (["render", "{set}", "--pair", "99"], "not 99"),
        (["render", "{set}", "--backend", "vulkan"], "unknown rendering backend 'vulkan'"),
        (["render", "{set}", "--backend", "raycast", "--width", "0"], "positive sizes"),
        (["view", "{set}"], "needs a display"),
        (["view", "{set}", "--scene", "nothing"], "unknown scene"),
    ],
)
def test_mistakes_end_in_one_line_and_exit_code_2(stored_set, tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.chdir(tmp_path)
    assert run([item.format(set=stored_set) for item in arguments]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line]
    assert len(lines) == 1
    assert message in lines[0]


def test_render_makes_a_video_of_each_episode_of_an_evaluation(stored_set, tmp_path):
    results, out = tmp_path / "results", tmp_path / "pictures"
    made = ["evaluate", "--policy", "zero", "--scenes", str(stored_set), "--out", str(results)]
    assert run([*made, "--pairs", "1", "--max-steps", "3"]) == 0
    arguments = ["--out", str(out), "--width", "48", "--height", "32", "--backend", "raycast", "--limit", "1"]
    assert run(["render", str(results), *arguments]) == 0
    videos = [path.name for path in out.glob("*.mp4")]
    assert len(videos) == 1
    assert videos[0].startswith("boxes-0_pair0_")
    assert (out / "contact_sheet.png").is_file()
