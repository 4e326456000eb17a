"""What cameras measure: depth and labels of single points, the same by OpenGL and by ray casting."""

import os
import subprocess
import sys
from contextlib import closing

import numpy as np
import pytest

from clutter6d.geometry import quat_conjugate, quat_to_matrix, rotate
from clutter6d.render import backend as backend_module
from clutter6d.render.backend import LOADED_VARIABLE
from clutter6d.render.camera import Camera
from clutter6d.render.picture import render_model
from clutter6d.render.sensor_model import ROBOT, TABLE, TARGET, make_sensor_model
from clutter6d.render.sensor_opengl import GraphicsContext, OpenGlSensors
from clutter6d.render.sensor_raycast import RaycastSensors
from clutter6d.sim.scene_model import joint_state
from tests.scene_fixtures import make_box_scene

VIEW = Camera(look_at_m=(0.0, 0.0, 0.0), distance_m=1.1, azimuth_deg=165.0, elevation_deg=-40.0, vertical_fov_deg=40.0)
WIDTH, HEIGHT = 96, 72
SCENE, MODEL = make_box_scene()
OBJECTS = list(zip(MODEL.names, MODEL.assets, strict=True))
POSES = SCENE.goal_pairs[0].object_poses
QPOS = joint_state(POSES)


def skip_without(name: str) -> None:
    if not backend_module._works(name):
        pytest.skip(f"{name} does not work on this machine")


@pytest.fixture(scope="module")
def opengl():
    skip_without("egl")
    with (
        closing(GraphicsContext("egl")) as context,
        closing(OpenGlSensors(make_sensor_model(OBJECTS), context, WIDTH, HEIGHT)) as sensors,
    ):
        yield sensors


@pytest.fixture(scope="module")
def raycast():
    return RaycastSensors(make_sensor_model(OBJECTS))


@pytest.fixture(params=["opengl", "raycast"])
def sensors(request):
    made = request.getfixturevalue(request.param)
    made.place(QPOS, 0.0)
    return made


def distance_to_box_m(points: np.ndarray, pose: np.ndarray, size_m: tuple[float, float, float]) -> np.ndarray:
    """Distance of world points to the surface of a box."""
    local = np.abs(rotate(quat_conjugate(pose[3:]), points - pose[:3])) - np.array(size_m) / 2
    outside = np.linalg.norm(np.maximum(local, 0), axis=-1)
    return np.where(local.max(axis=-1) > 0, outside, -local.max(axis=-1))


def test_depth_leads_back_to_the_surfaces_of_what_the_labels_say(sensors):
    depth, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
    points = VIEW.back_project(depth)
    for index, (asset, pose) in enumerate(zip(MODEL.assets, POSES, strict=True)):
        seen = points[labels == TARGET + index]
        assert len(seen) > 20
        assert distance_to_box_m(seen, pose, asset.extents_m).max() < 1e-3, MODEL.names[index]
    np.testing.assert_allclose(points[labels == TABLE][:, 2].max(), 0, atol=1e-3)
    assert (labels == ROBOT).any()


def test_a_rotated_body_is_measured_where_it_is(sensors):
    poses = POSES.copy()
    poses[0] = (0.05, 0.1, 0.2, *np.array([0.8, 0.2, 0.4, -0.4]))
    sensors.place(joint_state(poses), 0.0)
    depth, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
    seen = VIEW.back_project(depth)[labels == TARGET]
    assert len(seen) > 50
    assert distance_to_box_m(seen, poses[0], MODEL.assets[0].extents_m).max() < 1e-3


def test_opengl_and_ray_casting_agree(opengl, raycast):
    for height in (0.0, 0.05):
        pictures = []
        for sensors in (opengl, raycast):
            sensors.place(QPOS, height)
            pictures.append(sensors.measure(VIEW, WIDTH, HEIGHT))
        (depth, labels), (cast_depth, cast_labels) = pictures
        assert (labels != cast_labels).mean() < 0.003, "but for single pixels at edges"
        same = labels == cast_labels
        np.testing.assert_allclose(depth[same], cast_depth[same], atol=1e-3)
        for label in range(TARGET + len(MODEL.names)):
            seen, cast = (labels == label).sum(), (cast_labels == label).sum()
            assert abs(int(seen) - int(cast)) <= 3 + 0.01 * cast, f"label {label}"


def test_a_raised_table_is_measured_higher_and_lowered_again(sensors):
    tops = []
    for height in (0.0, 0.08, 0.0):
        sensors.place(QPOS, height)
        depth, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
        tops.append(VIEW.back_project(depth)[labels == TABLE][:, 2].max())
    np.testing.assert_allclose(tops, [0.0, 0.08, 0.0], atol=1e-3)


def test_depth_and_labels_are_of_single_points_never_averages(sensors):
    _, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
    assert set(np.unique(labels)) <= set(range(TARGET + len(MODEL.names)))
    colours = sensors.draw(VIEW, WIDTH, HEIGHT)
    assert colours.shape == (HEIGHT, WIDTH, 3)
    brown = colours[labels == TARGET].mean(axis=0)
    assert brown[0] > brown[1] > brown[2], "the box is brown where it is labelled"


def test_what_is_far_away_or_nothing_has_no_depth(sensors):
    sky = Camera(look_at_m=(2, 0, 2), distance_m=1, azimuth_deg=0, elevation_deg=40)
    depth, labels = sensors.measure(sky, WIDTH, HEIGHT)
    assert not depth.any()
    assert not labels.any()


def test_the_camera_matrix_projects_a_point_to_the_pixel_that_sees_it(sensors):
    depth, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
    row, column = np.argwhere(labels == TARGET)[17]
    point = VIEW.back_project(depth)[row, column]
    pose = VIEW.pose_camera_to_world()
    local = quat_to_matrix(np.array(pose.quat_wxyz)).T @ (point - pose.position)
    u, v, w = VIEW.intrinsics(WIDTH, HEIGHT) @ local
    np.testing.assert_allclose((u / w, v / w, w), (column, row, depth[row, column]), atol=1e-5)


def test_pictures_of_other_renderers_in_between_do_no_harm(opengl):
    opengl.place(QPOS, 0.0)
    before = (opengl.draw(VIEW, WIDTH, HEIGHT), *opengl.measure(VIEW, WIDTH, HEIGHT))
    render_model(opengl.shown.model, QPOS, width=64, height=64, backend="egl")
    opengl.measure(VIEW, 32, 24)
    after = (opengl.draw(VIEW, WIDTH, HEIGHT), *opengl.measure(VIEW, WIDTH, HEIGHT))
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


IN_A_PROCESS_OF_ITS_OWN = """
import sys
import numpy as np
from clutter6d.render.sensor_model import make_sensor_model
from clutter6d.render.sensor_opengl import GraphicsContext, OpenGlSensors
from tests.render.test_sensors import HEIGHT, OBJECTS, QPOS, VIEW, WIDTH
sensors = OpenGlSensors(make_sensor_model(OBJECTS), GraphicsContext("osmesa"), WIDTH, HEIGHT)
sensors.place(QPOS, 0.0)
depth, labels = sensors.measure(VIEW, WIDTH, HEIGHT)
np.savez(sys.argv[1], depth=depth, labels=labels)
"""


def test_osmesa_measures_what_ray_casting_does(raycast, tmp_path):
    skip_without("osmesa")
    environment = {name: value for name, value in os.environ.items() if name != LOADED_VARIABLE}
    command = [sys.executable, "-c", IN_A_PROCESS_OF_ITS_OWN, str(tmp_path / "seen.npz")]
    subprocess.run(command, check=True, env=environment)
    raycast.place(QPOS, 0.0)
    depth, labels = raycast.measure(VIEW, WIDTH, HEIGHT)
    seen = np.load(tmp_path / "seen.npz")
    same = seen["labels"] == labels
    assert same.mean() > 0.997
    np.testing.assert_allclose(seen["depth"][same], depth[same], atol=1e-3)
