"""Reading mesh files: every format arrives whole, every bad file is rejected with a reason."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from clutter6d.assets.mesh_colour import MAX_COLOURS
from clutter6d.assets.mesh_io import MeshLimits, read_mesh, read_mesh_file
from clutter6d.errors import MeshRejectedError, MissingFileError
from tests.assets.mesh_files import huge_glb, huge_ply_header, obj_text, truncated_stl

BOX = trimesh.creation.box((0.2, 0.1, 0.04))


def extents(shape: object) -> np.ndarray:
    return np.ptp(np.concatenate([item.mesh.vertices for item in shape.visual]), axis=0)


@pytest.mark.parametrize("suffix", ["obj", "glb", "stl", "ply", "dae"])
def test_every_format_is_read(suffix: str, tmp_path: Path) -> None:
    BOX.export(tmp_path / f"box.{suffix}")
    shape = read_mesh_file(tmp_path / f"box.{suffix}", up="z")
    assert sum(len(item.mesh.faces) for item in shape.visual) == 12
    np.testing.assert_allclose(extents(shape), (0.2, 0.1, 0.04), atol=1e-6)


def test_gltf_finds_its_buffers_beside_it(tmp_path: Path) -> None:
    for name, content in trimesh.Scene([BOX]).export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    shape = read_mesh_file(next(tmp_path.glob("*.gltf")), up="z")
    np.testing.assert_allclose(extents(shape), (0.2, 0.1, 0.04), atol=1e-6)


def test_obj_is_turned_from_y_up_to_z_up() -> None:
    shape = read_mesh(obj_text(BOX), "obj")
    np.testing.assert_allclose(extents(shape), (0.2, 0.04, 0.1), atol=1e-6)
    corners = shape.visual[0].mesh.vertices.astype(float)[shape.visual[0].mesh.faces]
    volume = (corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(0.2 * 0.1 * 0.04, rel=1e-5)


def test_several_objects_keep_their_places() -> None:
    scene = trimesh.Scene([BOX, BOX.copy().apply_translation((1, 0, 0))])
    assert extents(read_mesh(scene.export(file_type="glb"), "glb", up="z"))[0] == pytest.approx(1.2)


def test_materials_become_colours(tmp_path: Path) -> None:
    (tmp_path / "two.mtl").write_text("newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n")
    lines = obj_text(BOX).decode().splitlines()
    faces = [line for line in lines if line.startswith("f")]
    text = [line for line in lines if line.startswith("v")] + ["usemtl a", *faces[:4], "usemtl b", *faces[4:]]
    (tmp_path / "two.obj").write_text("mtllib two.mtl\n" + "\n".join(text) + "\n")
    found = {item.rgba: len(item.mesh.faces) for item in read_mesh_file(tmp_path / "two.obj").visual}
    assert found == {(1.0, 0.0, 0.0, 1.0): 4, (0.0, 0.0, 1.0, 1.0): 8}


def test_a_texture_becomes_at_most_eight_colours() -> None:
    rng = np.random.Generator(np.random.PCG64(0))
    image = Image.fromarray(rng.integers(0, 255, (16, 16, 3), dtype=np.uint8))
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.visual = trimesh.visual.TextureVisuals(uv=rng.random((len(ball.vertices), 2)), image=image)
    shape = read_mesh(ball.export(file_type="glb"), "glb")
    assert 2 <= len(shape.visual) <= MAX_COLOURS
    assert sum(len(item.mesh.faces) for item in shape.visual) == len(ball.faces)


BAD_FILES = {
    "an empty file": ("obj", b"", "empty"),
    "only spaces": ("obj", b"  \n ", "empty"),
    "no faces": ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "empty"),
    "NaN vertices": ("obj", b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not-finite"),
    "infinite vertices": ("obj", b"v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not-finite"),
    "a face beyond the vertices": ("obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "unreadable"),
    "words instead of numbers": ("obj", b"v a b c\nf 1 2 3\n", "unreadable"),
    "an image as OBJ": ("obj", b"\x89PNG\r\n\x1a\n" + bytes(range(256)), "empty"),
    "a truncated STL": ("stl", truncated_stl(), "unreadable"),
    "a truncated GLB": ("glb", trimesh.Scene([BOX]).export(file_type="glb")[:300], "unreadable"),
    "a GLB cut in its buffer": ("glb", trimesh.Scene([BOX]).export(file_type="glb")[:-200], "unreadable"),
    "text as GLB": ("glb", b"this is no glb file at all, sorry", "unreadable"),
    "a list as glTF": ("gltf", b"[]", "unreadable"),
    "deep JSON as glTF": ("gltf", b"[" * 100_000, "unreadable"),
    "a glTF without its buffer": ("gltf", trimesh.Scene([BOX]).export(file_type="gltf")["model.gltf"], "unreadable"),
    "a truncated PLY": ("ply", BOX.export(file_type="ply")[:200], "unreadable"),
    "a PLY without header": ("ply", b"ply\nnonsense", "unreadable"),
    "a PLY of four thousand million vertices": ("ply", huge_ply_header(), "too-many-vertices"),
    "a GLB of two thousand million vertices": ("glb", huge_glb(), "too-many-vertices"),
    "broken XML as DAE": ("dae", b"<COLLADA><library_geometries>", "unreadable"),
    "an unknown suffix": ("blend", b"BLENDER-v279", "unreadable"),
}


@pytest.mark.parametrize(("suffix", "content", "reason"), BAD_FILES.values(), ids=BAD_FILES.keys())
def test_a_bad_file_is_rejected_with_its_reason(suffix: str, content: bytes, reason: str) -> None:
    with pytest.raises(MeshRejectedError) as caught:
        read_mesh(content, suffix)
    assert caught.value.reason == reason
    assert "\n" not in str(caught.value)


def test_too_many_vertices_are_rejected_before_parsing() -> None:
    with pytest.raises(MeshRejectedError, match="too-many-vertices: 8 vertices; at most 7"):
        read_mesh(obj_text(BOX), "obj", limits=MeshLimits(max_vertices=7))


def test_a_large_file_is_not_even_read(tmp_path: Path) -> None:
    with (tmp_path / "big.obj").open("wb") as file:
        file.truncate(6_000_000)
    with pytest.raises(MeshRejectedError, match="too-large"):
        read_mesh_file(tmp_path / "big.obj")


def test_instances_count_as_vertices() -> None:
    scene = trimesh.Scene()
    for index in range(40):
        scene.add_geometry(BOX, geom_name="box", transform=trimesh.transformations.translation_matrix((index, 0, 0)))
    with pytest.raises(MeshRejectedError, match="too-many-vertices"):
        read_mesh(scene.export(file_type="glb"), "glb", limits=MeshLimits(max_vertices=100))


def test_a_material_outside_the_folder_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "secret.mtl").write_text("newmtl a\nKd 1 0 0\n")
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "box.obj").write_bytes(b"mtllib ../secret.mtl\nusemtl a\n" + obj_text(BOX))
    assert read_mesh_file(folder / "box.obj").visual[0].rgba[0] < 1


def test_a_missing_file_is_the_users_mistake(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError):
        read_mesh_file(tmp_path / "none.obj")


def test_text_that_is_not_utf8_is_read_as_latin1() -> None:
    material = "newmtl grün\nKd 0 1 0\n".encode("latin-1")
    text = "# Möbel\nmtllib a.mtl\nusemtl grün\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".encode("latin-1")
    shape = read_mesh(text, "obj", companions={"a.mtl": material})
    assert shape.visual[0].rgba[:3] == pytest.approx((0, 1, 0), abs=0.01)
