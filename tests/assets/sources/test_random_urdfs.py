"""The random URDFs: read from a folder or a wheel, scaled, weighed and licensed; a bad one is one clean rejection."""

import zipfile
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest

from clutter6d.assets.sources.random_urdfs import MAX_URDF_BYTES, RandomUrdfsSource, parse_urdf
from clutter6d.errors import (
    InvalidFileError,
    InvalidValueError,
    MeshRejectedError,
    MissingDependencyError,
    MissingFileError,
)

URDF = """<robot name="blob{key}"><link name="random_obj_{key}">
  <inertial><origin rpy="0 0 0" xyz="0 0 0"/><mass value="0.1"/></inertial>
  <visual><geometry><mesh filename="{key}.obj" scale="0.015 0.015 0.015"/></geometry>
    <material name="blockmat"><color rgba="0.04 0.07 0.91 1"/></material></visual>
</link></robot>"""

TETRAHEDRON = "v 0 0 0\nv 4 0 0\nv 0 5 0\nv 0 0 6\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
NOT_NUMBERS = "v nan nan nan\n" * 4 + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def write_object(folder: Path, key: str, mesh: str = TETRAHEDRON) -> None:
    (folder / key).mkdir(parents=True)
    (folder / key / f"{key}.urdf").write_text(URDF.format(key=key))
    (folder / key / f"{key}.obj").write_text(mesh)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    root = tmp_path / "random_urdfs"
    for key in ("000", "001"):
        write_object(root, key)
    write_object(root, "168", NOT_NUMBERS)
    return root


@pytest.fixture
def wheel(folder: Path) -> Path:
    path = folder.parent / "pybullet-3.2.7-cp311-cp311-linux_x86_64.whl"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("pybullet_data/other.txt", "not ours")
        for file in sorted(folder.rglob("*.*")):
            archive.write(file, f"pybullet_data/random_urdfs/{file.relative_to(folder)}")
    return path


def test_objects_are_listed_with_mass_and_licence(folder: Path):
    items = RandomUrdfsSource(folder).objects()
    assert [item.key for item in items] == ["000", "001", "168"]
    assert items[0].name == "compound-000"
    assert items[0].hints.mass_kg == 0.1
    assert items[0].licence.name == "Zlib"
    assert items[0].licence.source_id == "000"


def test_the_shape_is_in_metres_and_in_the_urdfs_colour(folder: Path):
    source = RandomUrdfsSource(folder)
    (visual,) = source.load(source.objects()[0]).visual
    np.testing.assert_allclose(np.ptp(visual.mesh.vertices, axis=0), [0.06, 0.075, 0.09], rtol=1e-6)
    assert visual.rgba == (0.04, 0.07, 0.91, 1.0)


def test_a_wheel_gives_the_same_as_the_folder(folder: Path, wheel: Path):
    unpacked, packed = RandomUrdfsSource(folder), RandomUrdfsSource(wheel)
    assert packed.objects() == unpacked.objects()
    item = packed.objects()[1]
    assert packed.fingerprint(item) == unpacked.fingerprint(item)
    a, b = packed.load(item).visual[0].mesh, unpacked.load(item).visual[0].mesh
    assert a.vertices.tobytes() == b.vertices.tobytes()


def test_an_object_that_does_not_load_is_one_rejection(folder: Path):
    source = RandomUrdfsSource(folder)
    broken = source.objects()[-1]
    assert broken.key == "168"
    with pytest.raises(MeshRejectedError):
        source.load(broken)


def test_a_mesh_that_is_missing_is_one_rejection(folder: Path):
    (folder / "001" / "001.obj").unlink()
    source = RandomUrdfsSource(folder)
    with pytest.raises(MeshRejectedError, match="not beside its URDF"):
        source.load(source.objects()[1])


def test_the_fingerprint_follows_the_mesh(folder: Path):
    source = RandomUrdfsSource(folder)
    item = source.objects()[0]
    before = source.fingerprint(item)
    (folder / "000" / "000.obj").write_text(TETRAHEDRON.replace("v 4", "v 5"))
    assert source.fingerprint(item) != before


def test_the_count_limits_the_list(folder: Path):
    assert len(RandomUrdfsSource(folder, count=2).objects()) == 2
    with pytest.raises(InvalidValueError, match="between 0 and 1000"):
        RandomUrdfsSource(folder, count=1001)


def test_paths_that_hold_nothing_are_refused(tmp_path: Path):
    with pytest.raises(MissingFileError, match="pybullet wheel not found"):
        RandomUrdfsSource(tmp_path / "absent.whl")
    with pytest.raises(InvalidFileError, match="holds no random URDFs"):
        RandomUrdfsSource(tmp_path).objects()
    (tmp_path / "text.whl").write_text("not a zip")
    with pytest.raises(InvalidFileError, match="neither a folder nor a wheel"):
        RandomUrdfsSource(tmp_path / "text.whl").objects()


def test_without_the_package_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'clutter6d\[sources\]'"):
        RandomUrdfsSource()


GOOD = URDF.format(key="000")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not XML"),
        (b"<robot><link></robot>", "not XML"),
        (b"<sdf/>", "not the URDF of one rigid object"),
        (b"<robot><link/><link/></robot>", "not the URDF of one rigid object"),
        (b"<robot><link/></robot>", "lacks the attribute 'filename'"),
        (GOOD.replace("000.obj", "../../etc/passwd").encode(), "not an OBJ file beside the URDF"),
        (GOOD.replace("000.obj", "/etc/a.obj").encode(), "not an OBJ file beside the URDF"),
        (GOOD.replace('scale="0.015 0.015 0.015"', 'scale="0.015"').encode(), "expected 3 finite numbers"),
        (GOOD.replace('mass value="0.1"', 'mass value="nan"').encode(), "expected 1 finite numbers"),
        (GOOD.replace('mass value="0.1"', 'mass value="-1"').encode(), "must be positive"),
        (GOOD.replace('rgba="0.04 0.07 0.91 1"', 'rgba="4 0 0 1"').encode(), "must be positive"),
        (b'<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]>' + GOOD.encode(), "document type"),
        (b"<robot>" + b" " * MAX_URDF_BYTES + b"</robot>", "too many for a URDF"),
    ],
)
def test_a_bad_urdf_is_refused_with_its_reason(content: bytes, message: str):
    with pytest.raises(InvalidFileError, match=message):
        parse_urdf(content, where="000.urdf")


def test_it_is_registered_as_an_asset_source():
    (entry,) = entry_points(group="clutter6d.asset_sources", name="random_urdfs")
    assert entry.load() is RandomUrdfsSource
