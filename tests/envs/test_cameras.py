"""Cameras as part of an observation."""

import numpy as np
import pytest

from clutter6d.assets.surface_distance import SurfaceDistance
from clutter6d.dataset.scenes import load_split
from clutter6d.envs.cameras import CAMERA_KINDS, DEFAULT_CAMERAS, CameraConfig, CameraRig, camera_spaces
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.geometry import quat_conjugate, rotate, transform_points
from clutter6d.render.camera import Camera
from clutter6d.render.sensor_model import TABLE, TARGET
from clutter6d.sim.model_variation import raise_poses, vary_model
from clutter6d.sim.scene_model import compile_stored_scene, joint_state
from tests.scene_fixtures import make_box_scene

SCENES = [make_box_scene(index) for index in range(3)]
MODELS = [model for _, model in SCENES]
QPOS = np.stack([joint_state(scene.goal_pairs[0].object_poses) for scene, _ in SCENES])
VIEW = DEFAULT_CAMERAS[0].camera


@pytest.fixture(scope="module")
def rig():
    """By whatever this machine has; that all agree is tested in ``tests/render/test_sensors.py``."""
    with CameraRig() as made:
        yield made


def test_three_cameras_give_three_kinds_of_picture_each_as_their_spaces_say(rig):
    seen, spaces = rig.observe(MODELS, QPOS), camera_spaces(DEFAULT_CAMERAS)
    assert set(seen) == {f"camera_{name}_{kind}" for name in ("front", "left", "right") for kind in CAMERA_KINDS}
    for name, pictures in seen.items():
        assert len(pictures) == 3
        assert all(spaces[name].contains(picture) for picture in pictures), name


def test_every_camera_sees_every_box_and_the_table(rig):
    for camera in DEFAULT_CAMERAS:
        for labels in rig.observe(MODELS, QPOS)[f"camera_{camera.name}_segmentation"]:
            assert {TABLE, *range(TARGET, TARGET + 4)} <= set(np.unique(labels))


def test_a_slots_pictures_are_those_of_its_own_scene_and_state(rig):
    together, alone = rig.observe(MODELS, QPOS), rig.observe(MODELS[2:], QPOS[2:])
    assert all(np.array_equal(together[name][2], alone[name][0]) for name in together)
    moved = QPOS.copy()
    moved[1, 7:10] += (0.1, 0.1, 0.0)
    changed = rig.observe(MODELS, moved)["camera_front_depth"] != together["camera_front_depth"]
    assert changed.any(axis=(1, 2)).tolist() == [False, True, False]


def test_a_varied_scene_is_drawn_with_its_table(rig):
    height = 0.06
    raised = vary_model(MODELS[0], table_height_m=height)
    poses = raise_poses(SCENES[0][0].goal_pairs[0].object_poses, height)
    both = rig.observe([MODELS[0], raised], np.stack([QPOS[0], joint_state(poses)]))
    for depth, labels, expected in zip(
        both["camera_left_depth"], both["camera_left_segmentation"], (0.0, height), strict=True
    ):
        points = DEFAULT_CAMERAS[1].camera.back_project(depth)
        assert points[labels == TABLE][:, 2].max() == pytest.approx(expected, abs=1e-3)


def test_surface_points_of_the_target_project_into_its_label(rig):
    labels = rig.observe(MODELS[:1], QPOS[:1])["camera_front_segmentation"][0]
    camera = DEFAULT_CAMERAS[0]
    points = transform_points(SCENES[0][0].goal_pairs[0].object_poses[0], MODELS[0].assets[0].surface_points * 0.9)
    local = (points - camera.camera.position()) @ camera.camera.rotation_camera_to_world()
    pixels = local @ camera.intrinsics().T
    columns, rows = np.rint(pixels[:, :2] / pixels[:, 2:]).astype(int).T
    assert (labels[rows, columns] == TARGET).mean() > 0.95


def test_depth_of_procedural_objects_leads_back_to_their_meshes(rig):
    split = load_split("moderate-test")
    scene = split[3]
    model = compile_stored_scene(scene, split.assets_of(scene))
    poses = scene.goal_pairs[0].object_poses
    seen = rig.observe([model], joint_state(poses)[None])
    for camera in DEFAULT_CAMERAS:
        points = camera.camera.back_project(seen[f"camera_{camera.name}_depth"][0])
        labels = seen[f"camera_{camera.name}_segmentation"][0]
        for index, (asset, pose) in enumerate(zip(model.assets, poses, strict=True)):
            local = rotate(quat_conjugate(pose[3:]), points[labels == TARGET + index] - pose[:3])
            found = [
                SurfaceDistance(item.mesh.vertices, item.mesh.faces).closest(local, neighbours=32)[1]
                for item in asset.visual
            ]
            assert np.min(found, axis=0).max(initial=0) < 1e-3, f"{asset.name} seen by {camera.name}"


def test_only_what_is_asked_for_is_drawn():
    camera = CameraConfig(name="above", camera=VIEW, width=40, height=30, kinds=("depth",))
    with CameraRig([camera]) as rig:
        assert {name: value.shape for name, value in rig.observe(MODELS[:1], QPOS[:1]).items()} == {
            "camera_above_depth": (1, 30, 40)
        }


def test_scenes_not_drawn_for_longest_are_forgotten_and_drawn_again():
    camera = CameraConfig(name="small", camera=VIEW, width=32, height=24)
    with CameraRig([camera], kept_scenes=2) as rig:
        first = [rig.observe([MODELS[slot]], QPOS[slot : slot + 1]) for slot in (0, 1, 2, 0)]
        assert len(rig._sensors) == 2
        assert all(np.array_equal(first[0][name], first[3][name]) for name in first[0])


def test_pictures_without_opengl_have_the_same_entries():
    camera = CameraConfig(name="slow", camera=VIEW, width=24, height=18)
    with CameraRig([camera], backend="raycast") as rig:
        seen = rig.observe(MODELS[:1], QPOS[:1])
    assert {name: rig.spaces[name].contains(value[0]) for name, value in seen.items()} == dict.fromkeys(
        rig.spaces, True
    )


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"name": "left side"}, InvalidValueError, "use letters, digits and underscores"),
        ({"width": 0}, InvalidValueError, "camera 'front' of 0 x 96 pixels: give sides of 1 to 2048"),
        ({"height": 100_000}, InvalidValueError, "give sides of 1 to 2048"),
        ({"kinds": ("rgb", "dept")}, UnknownNameError, "did you mean 'depth'"),
        ({"kinds": ()}, InvalidValueError, "at least one kind of picture"),
        ({"kinds": ("rgb", "rgb")}, InvalidValueError, "each once"),
    ],
)
def test_cameras_that_cannot_be_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        CameraConfig(**{"name": "front", "camera": VIEW, **options})


def test_two_cameras_of_one_name_and_a_rig_without_any_are_refused():
    with pytest.raises(InvalidValueError, match="same name"):
        CameraRig([DEFAULT_CAMERAS[0], DEFAULT_CAMERAS[0]], backend="raycast")
    with pytest.raises(InvalidValueError, match="at least one of each"):
        CameraRig([], backend="raycast")


def test_a_camera_looks_along_its_third_axis():
    camera = Camera(look_at_m=(0, 0, 0), distance_m=2.0, azimuth_deg=0.0, elevation_deg=0.0)
    np.testing.assert_allclose(camera.rotation_camera_to_world(), [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], atol=1e-12)
    assert camera.pose_camera_to_world().position == pytest.approx((-2.0, 0, 0))
