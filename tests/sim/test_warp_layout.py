import mujoco
import numpy as np
import pytest

from clutter6d.assets.decomposition import MAX_PARTS
from clutter6d.errors import InvalidValueError
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_buffers import BufferSizes
from clutter6d.sim.warp_layout import WorldLayout
from clutter6d.sim.warp_meshes import MeshPool
from clutter6d.sim.warp_runtime import open_device, torch
from tests.scene_fixtures import make_box_scene

STRUCTURE = ("nq", "nv", "nu", "njnt", "nM", "nD", "nC")
SAME_ROWS = ("body_parentid", "body_dofadr", "body_pos", "body_quat", "body_gravcomp")


@pytest.fixture(scope="module")
def scene():
    return make_box_scene(0)[1]


@pytest.fixture(scope="module")
def layout():
    return WorldLayout(4)


@pytest.fixture
def pool():
    return MeshPool(open_device("cpu"))


def mesh_ids(layout, pool, scene):
    firsts = layout.first_geoms(scene)
    return [pool.ids(asset, scene.model, int(first)) for asset, first in zip(scene.assets, firsts, strict=True)]


def test_shared_model_has_the_structure_and_options_of_every_scene(layout, scene):
    shared, model = layout.model, scene.model
    assert [getattr(shared, name) for name in STRUCTURE] == [getattr(model, name) for name in STRUCTURE]
    assert np.array_equal(shared.M_rownnz, model.M_rownnz)
    for name in SAME_ROWS:
        assert np.array_equal(getattr(shared, name), getattr(model, name)[: shared.nbody]), name
    for name in ("timestep", "integrator", "iterations", "ls_iterations", "cone", "solver"):
        assert getattr(shared.opt, name) == getattr(model.opt, name), name


def test_a_row_holds_what_the_scenes_own_model_holds(layout, pool, scene):
    row = layout.row(scene, mesh_ids(layout, pool, scene))
    bodies = [scene.model.body(name).id for name in scene.names]
    assert np.array_equal(row["body_mass"][bodies], scene.object_masses_kg())
    for number, body in enumerate(bodies):
        geom = scene.model.body_geomadr[body]
        room = layout.model.body_geomadr[body]
        assert row["geom_friction"][room, 0] == scene.object_frictions()[number]
        for name in ("geom_pos", "geom_quat", "geom_size", "geom_rbound", "geom_aabb"):
            assert np.array_equal(row[name][room], getattr(scene.model, name)[geom]), name


def test_room_for_parts_that_an_asset_does_not_have_stays_without_a_mesh(layout, pool, scene):
    row = layout.row(scene, mesh_ids(layout, pool, scene))
    of_objects = row["geom_dataid"][-4 * MAX_PARTS :].reshape(4, MAX_PARTS)
    assert (of_objects >= 0).sum(axis=1).tolist() == [len(asset.parts) for asset in scene.assets]
    assert (of_objects[:, 1:] == -1).all()


def test_the_pool_holds_each_assets_meshes_once(layout, pool, scene):
    first, again = mesh_ids(layout, pool, scene), mesh_ids(layout, pool, scene)
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert pool.meshes == sum(len(asset.parts) for asset in scene.assets)


def test_pooled_meshes_are_those_of_the_models_they_come_from(layout, pool):
    target = type("Model", (), {})()
    scenes = [make_box_scene(index)[1] for index in range(3)]
    ids = [mesh_ids(layout, pool, scene) for scene in scenes]
    pool.attach(target)
    vertices = target.mesh_vert.numpy()
    for scene, owned in zip(scenes, ids, strict=True):
        for asset, (mesh,), body in zip(scene.assets, owned, layout.first_geoms(scene), strict=True):
            start, count = target.mesh_vertadr.numpy()[mesh], target.mesh_vertnum.numpy()[mesh]
            pose = scene.model.geom_pos[body], scene.model.geom_quat[body]
            placed = np.stack([_place(vertex, *pose) for vertex in vertices[start : start + count]])
            assert np.allclose(np.sort(placed, axis=0), np.sort(asset.parts[0].vertices, axis=0), atol=1e-6)


def test_the_pool_grows_without_losing_anything(layout, pool):
    revision, target = pool.revision, type("Model", (), {})()
    first = make_box_scene(0)[1]
    mesh_ids(layout, pool, first)
    pool.attach(target)
    before = target.mesh_vert.numpy()[: 8 * 4].copy()
    for index in range(1, 40):
        mesh_ids(layout, pool, make_box_scene(index)[1])
    pool.attach(target)
    assert pool.revision > revision
    assert np.array_equal(target.mesh_vert.numpy()[: 8 * 4], before)
    assert pool.meshes == 160


@pytest.mark.parametrize(
    ("device", "said"),
    [("gpu", "unknown"), ("mps", "not supported by Warp"), ("cuda:99", "CUDA device")],
)
def test_a_device_that_is_not_there_is_refused_in_one_line(device, said):
    with pytest.raises(InvalidValueError, match=said) as caught:
        open_device(device)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a CUDA device")
def test_cuda_without_a_cuda_device_is_refused_with_what_to_do(scene):
    with pytest.raises(InvalidValueError, match="install NVIDIA's driver"):
        WarpSceneBatch([scene])


def test_scenes_of_different_sizes_and_empty_buffers_are_refused(scene):
    with pytest.raises(InvalidValueError, match="same number of objects"):
        WarpSceneBatch([], device="cpu")
    with pytest.raises(InvalidValueError, match="1 or more"):
        BufferSizes(contacts=0, constraints=10)


def _place(point, position, quat):
    out = np.zeros(3)
    mujoco.mju_rotVecQuat(out, point.astype(float), quat)
    return out + position
