"""Drawing a model: what is seen, by which renderer, and what happens where OpenGL is missing."""

import logging
import os
import subprocess
import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, MissingDependencyError, UnknownNameError
from clutter6d.render import backend as backend_module
from clutter6d.render.backend import GL_VARIABLE, LOADED_VARIABLE, choose_backend
from clutter6d.render.camera import SCENE_VIEW, Camera
from clutter6d.render.picture import open_renderer, render_model, render_rollout
from clutter6d.render.studio import GHOST_GROUP, add_studio

VIEW = Camera(look_at_m=(0.0, 0.0, 0.0), distance_m=3.0, azimuth_deg=90.0, elevation_deg=-10.0)


def works(name: str) -> bool:
    return name == "raycast" or backend_module._works(name)


@pytest.fixture(params=["egl", "raycast"])
def backend(request) -> str:
    if not works(request.param):
        pytest.skip(f"{request.param} does not work on this machine")
    return request.param


def ball_model(**options) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    add_studio(spec)
    body = spec.worldbody.add_body(name="ball")
    body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(1, 0, 0))
    options = {"rgba": (0.9, 0.1, 0.1, 1)} | options
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.4, 0, 0), **options)
    return spec.compile()


def redness(image: np.ndarray) -> np.ndarray:
    colour = image.astype(int)
    return colour[..., 0] - colour[..., 1]


def test_a_red_ball_is_seen_where_it_is(backend):
    image = render_model(ball_model(), np.zeros(1), VIEW, width=96, height=64, backend=backend)
    assert image.shape == (64, 96, 3)
    assert image.dtype == np.uint8
    is_red = redness(image) > 60
    rows, columns = np.nonzero(is_red)
    assert rows.mean() == pytest.approx(31.5, abs=2)
    assert columns.mean() == pytest.approx(47.5, abs=1)
    radius_px = np.sqrt(is_red.sum() / np.pi)
    expected = 32 * np.tan(np.arcsin(0.4 / 3)) / np.tan(np.deg2rad(VIEW.vertical_fov_deg / 2))
    assert radius_px == pytest.approx(expected, rel=0.08)


def test_looking_along_y_a_move_along_x_goes_right(backend):
    """Azimuth 90 looks along +y, so +x is on the right."""
    images = list(
        render_rollout(ball_model(), [np.array([0.0]), np.array([0.3])], VIEW, width=96, height=64, backend=backend)
    )
    left, right = (np.nonzero(redness(image) > 60)[1].mean() for image in images)
    assert right > left + 5


def test_the_upper_side_is_lighter_than_the_lower(backend):
    image = render_model(ball_model(), np.zeros(1), VIEW, width=96, height=64, backend=backend)
    column = image[redness(image[:, 48]) > 60, 48, 0].astype(int)
    assert column[2:5].mean() > column[-5:-2].mean() + 10


def test_ghosts_are_translucent(backend):
    solid, ghost = (
        render_model(
            ball_model(group=group, rgba=(0.9, 0.1, 0.1, 0.4)), np.zeros(1), VIEW, width=64, height=64, backend=backend
        )[32, 32].astype(int)
        for group in (0, GHOST_GROUP)
    )
    assert ghost[2] > 60, "the light background shows through"
    if backend == "raycast":
        assert solid[2] < 60


def test_rendering_does_not_change_the_model(backend):
    model = ball_model()
    before = (model.vis.global_.offwidth, model.vis.global_.fovy, model.qpos0.copy())
    render_model(model, np.zeros(1), replace(VIEW, vertical_fov_deg=20.0), width=32, height=32, backend=backend)
    assert (model.vis.global_.offwidth, model.vis.global_.fovy) == before[:2]


def test_collision_geometry_is_shown_where_there_is_nothing_else(backend):
    spec = mujoco.MjSpec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=(0.4, 0, 0), group=3, rgba=(0.9, 0.1, 0.1, 1))
    image = render_model(spec.compile(), np.zeros(0), VIEW, width=32, height=32, backend=backend)
    assert redness(image)[16, 16] > 40


IN_A_PROCESS_OF_ITS_OWN = """
import sys
import mujoco, numpy as np
from clutter6d.render.camera import Camera
from clutter6d.render.picture import render_model
model = mujoco.MjModel.from_xml_path(sys.argv[1])
view = Camera(look_at_m=(0.0, 0.0, 0.0), distance_m=3.0, azimuth_deg=90.0, elevation_deg=-10.0)
np.save(sys.argv[2], render_model(model, np.zeros(1), view, width=96, height=64, backend="osmesa"))
"""


def test_osmesa_draws_what_egl_draws(tmp_path):
    if not (works("osmesa") and works("egl")):
        pytest.skip("EGL or OSMesa does not work on this machine")
    (tmp_path / "ball.xml").write_text(
        "<mujoco><worldbody><light pos='0 -2 2' dir='0 1 -1'/><body><joint type='slide' axis='1 0 0'/>"
        "<geom type='sphere' size='0.4' rgba='0.9 0.1 0.1 1'/></body></worldbody></mujoco>"
    )
    arguments = [str(tmp_path / "ball.xml"), str(tmp_path / "picture.npy")]
    environment = {name: value for name, value in os.environ.items() if name != LOADED_VARIABLE}
    subprocess.run([sys.executable, "-c", IN_A_PROCESS_OF_ITS_OWN, *arguments], check=True, env=environment)
    model = mujoco.MjModel.from_xml_path(arguments[0])
    drawn = render_model(model, np.zeros(1), VIEW, width=96, height=64, backend="egl")
    assert np.abs(np.load(arguments[1]).astype(int) - drawn).mean() < 2


def test_a_process_keeps_to_the_opengl_it_has_loaded(monkeypatch):
    monkeypatch.setenv(LOADED_VARIABLE, "egl")
    with pytest.raises(InvalidValueError, match="already draws with 'egl'"):
        choose_backend("osmesa")


def test_auto_falls_back_to_the_ray_caster_and_names_the_packages(monkeypatch, caplog):
    monkeypatch.setenv(GL_VARIABLE, "disabled")
    monkeypatch.delenv(LOADED_VARIABLE, raising=False)
    backend_module._warn_of_ray_caster.cache_clear()
    with caplog.at_level(logging.WARNING):
        assert choose_backend("auto") == "raycast"
        assert choose_backend("auto") == "raycast"
    assert caplog.text.count("libegl1") == 1
    assert "libosmesa6" in caplog.text


def test_a_backend_that_does_not_work_is_refused_with_the_packages_to_install(monkeypatch):
    monkeypatch.setattr(backend_module, "_PROBE", "import os; os.abort()")
    monkeypatch.delenv(LOADED_VARIABLE, raising=False)
    backend_module._works.cache_clear()
    try:
        with pytest.raises(MissingDependencyError, match=r"libegl1.*--backend raycast"):
            choose_backend("egl")
        monkeypatch.delenv(GL_VARIABLE, raising=False)
        assert choose_backend("auto") == "raycast"
    finally:
        backend_module._works.cache_clear()


def test_unknown_backends_and_sizes_are_refused():
    with pytest.raises(UnknownNameError, match="did you mean 'raycast'"):
        choose_backend("raycaster")
    for width, height in [(0, 10), (10, -1), (100_000, 100_000)]:
        with pytest.raises(InvalidValueError), open_renderer(ball_model(), width=width, height=height):
            pass


def test_ray_caster_draws_the_same_picture_twice():
    with open_renderer(ball_model(), width=48, height=48, backend="raycast") as renderer:
        first, second = (renderer.draw(np.zeros(1), SCENE_VIEW) for _ in range(2))
    assert np.array_equal(first, second)
