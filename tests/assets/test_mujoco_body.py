"""An asset in a MuJoCo model: geometry where the asset has it, the asset's own inertia, the benchmark's contacts."""

import mujoco
import numpy as np
import pytest

from clutter6d.assets.asset import Asset
from clutter6d.assets.mujoco_body import add_asset_body
from clutter6d.geometry import rotate
from clutter6d.physics import COLLISION_GROUP, OBJECT_CONTACT, VISUAL_GROUP


def compile_body(asset: Asset, *, visuals: bool = False) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    add_asset_body(spec, asset, name="thing", visuals=visuals)
    return spec.compile()


def world_vertices(model: mujoco.MjModel, geom: str) -> np.ndarray:
    found = model.geom(geom)
    mesh = model.mesh(found.dataid[0])
    rows = model.mesh_vert[mesh.vertadr[0] : mesh.vertadr[0] + mesh.vertnum[0]].astype(float)
    return rotate(found.quat, rows) + found.pos


def test_geometry_lands_exactly(bracket: Asset) -> None:
    model = compile_body(bracket, visuals=True)
    for index, part in enumerate(bracket.parts):
        np.testing.assert_allclose(world_vertices(model, f"thing_part{index}"), part.vertices, atol=1e-7)
    for index, item in enumerate(bracket.visual):
        np.testing.assert_allclose(world_vertices(model, f"thing_visual{index}"), item.mesh.vertices, atol=1e-7)


def test_mass_and_inertia_are_the_assets(bracket: Asset) -> None:
    model = compile_body(bracket, visuals=True)
    body = model.body("thing")
    assert body.mass[0] == pytest.approx(bracket.mass_properties.mass_kg)
    np.testing.assert_allclose(body.ipos, 0, atol=1e-12)
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, body.iquat)
    turned = axes.reshape(3, 3) @ np.diag(body.inertia) @ axes.reshape(3, 3).T
    np.testing.assert_allclose(turned, bracket.mass_properties.inertia, rtol=1e-6, atol=1e-12)


def test_collision_and_visual_geoms_keep_to_their_groups(bracket: Asset) -> None:
    model = compile_body(bracket, visuals=True)
    parts, visual = model.geom("thing_part0"), model.geom("thing_visual0")
    assert (parts.contype[0], parts.conaffinity[0]) == OBJECT_CONTACT
    assert (visual.contype[0], visual.conaffinity[0]) == (0, 0)
    assert (parts.group[0], visual.group[0]) == (COLLISION_GROUP, VISUAL_GROUP)
    assert parts.friction[0] == pytest.approx(bracket.attributes.friction)


def test_without_visuals_there_are_only_parts(bracket: Asset) -> None:
    assert compile_body(bracket).ngeom == len(bracket.parts)
