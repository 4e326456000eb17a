"""What is to be seen of a model, as triangles."""

import mujoco
import numpy as np
import pytest

from clutter6d.play.shapes import Shape, visible_shapes
from clutter6d.render.scene_picture import GHOST_RGBA, picture_model
from tests.scene_fixtures import make_box_scene_set


@pytest.fixture(scope="module")
def shapes() -> tuple[Shape, ...]:
    made = make_box_scene_set(1)
    return visible_shapes(picture_model(made.scenes[0], made.assets_of(made.scenes[0])).model)


@pytest.fixture(scope="module")
def model() -> mujoco.MjModel:
    made = make_box_scene_set(1)
    return picture_model(made.scenes[0], made.assets_of(made.scenes[0])).model


def of_body(shapes: tuple[Shape, ...], model: mujoco.MjModel, name: str) -> list[Shape]:
    return [shape for shape in shapes if shape.body == model.body(name).id]


def test_an_object_is_where_it_is_and_has_its_colour(shapes, model) -> None:
    (shape,) = of_body(shapes, model, "target")
    assert np.ptp(shape.vertices, axis=0) == pytest.approx([0.06, 0.09, 0.14], abs=1e-6)
    assert np.abs(shape.vertices.mean(axis=0)).max() < 1e-6
    assert shape.rgb == (178, 128, 77)
    assert shape.opacity == 1


def test_the_edges_of_a_box_stay_sharp(shapes, model) -> None:
    (shape,) = of_body(shapes, model, "target")
    assert len(shape.vertices) == 24


def test_the_goal_is_a_ghost(shapes, model) -> None:
    (ghost,) = of_body(shapes, model, "target_goal")
    assert ghost.opacity == pytest.approx(GHOST_RGBA[3])
    (target,) = of_body(shapes, model, "target")
    assert np.sort(ghost.vertices, axis=0) == pytest.approx(np.sort(target.vertices, axis=0))


def test_the_robot_is_shown_by_its_shells_and_not_by_its_collision_geometry(shapes, model) -> None:
    links = [shape for name in ("fr3_link1", "fr3_link5", "hand") for shape in of_body(shapes, model, name)]
    assert len(links) >= 5
    shown = sum(len(shape.faces) for shape in of_body(shapes, model, "fr3_link1"))
    visual = [geom for geom in range(model.ngeom) if model.geom(geom).name.startswith("fr3_link1_visual")]
    assert shown == sum(model.mesh_facenum[model.geom_dataid[geom]] for geom in visual)


def test_every_face_names_vertices_of_its_shape(shapes) -> None:
    for shape in shapes:
        assert shape.faces.min() == 0
        assert shape.faces.max() == len(shape.vertices) - 1
