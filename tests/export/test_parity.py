"""MJCF and USD are the same scene, as plain MuJoCo and plain OpenUSD read them."""

from pathlib import Path

import numpy as np
import pytest
from check_usd_parity import LIMIT, compare, relative_error
from hypothesis import given
from hypothesis import strategies as st
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics

from clutter6d.export.mjcf import export_mjcf
from clutter6d.export.usd import export_usd
from clutter6d.export.usd_prims import make_rigid_body
from clutter6d.geometry import quat_normalize, quat_to_matrix
from tests.export.export_fixtures import crooked_scene


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("parity")
    return export_mjcf(*crooked_scene(), folder), export_usd(*crooked_scene(), folder)


def test_mjcf_and_usd_are_equal_to_a_millionth(files: tuple[Path, Path]) -> None:
    errors = compare(*files)
    assert {name: error for name, error in errors.items() if error > LIMIT} == {}
    quantities = {"mass", "inertia", "centre of mass", "colliders", "positions", "orientations", "friction"}
    assert quantities | {"joint limits", "drives", "collider corners", "goal pairs", "links"} <= errors.keys()


@pytest.mark.parametrize(
    ("quantity", "path", "attribute", "change"),
    [
        ("mass", "objects/target", "physics:mass", lambda mass: mass * 1.00001),
        ("inertia", "objects/target", "physics:principalAxes", lambda axes: Gf.Quatf(1)),
        ("centre of mass", "robot/fr3_link3", "physics:centerOfMass", lambda centre: centre * 1.00001),
        ("friction", "table/friction", "physics:dynamicFriction", lambda value: value + 1e-5),
        ("collider corners", "robot/fr3_link5/collision/shape_0", "radius", lambda radius: radius + 1e-5),
        ("joint limits", "robot/joints/fr3_joint4", "physics:upperLimit", lambda limit: limit + 1e-3),
        ("drives", "robot/joints/fr3_joint7", "drive:angular:physics:stiffness", lambda gain: gain * 57.3),
    ],
)
def test_a_difference_is_found(files: tuple[Path, Path], tmp_path, quantity, path, attribute, change) -> None:
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(files[1])))
    found = stage.GetPrimAtPath(f"/World/{path}").GetAttribute(attribute)
    found.Set(change(found.Get()))
    assert stage.GetRootLayer().Export(str(tmp_path / "changed.usd"))
    errors = compare(files[0], tmp_path / "changed.usd")
    assert [name for name, error in errors.items() if error > LIMIT] == [quantity]


def test_a_missing_part_is_found(files: tuple[Path, Path], tmp_path) -> None:
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(files[1])))
    stage.RemovePrim("/World/objects/target/collision/part_1")
    assert stage.GetRootLayer().Export(str(tmp_path / "changed.usd"))
    assert compare(files[0], tmp_path / "changed.usd")["colliders"] > LIMIT


@given(
    st.lists(st.floats(1e-3, 1.0), min_size=3, max_size=3),
    st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda quat: np.linalg.norm(quat) > 0.1),
    st.floats(-7, 0),
)
def test_any_inertia_comes_back(sides: list[float], quat: list[float], exponent: float) -> None:
    axes = quat_to_matrix(quat_normalize(np.array(quat)))
    squares = np.square(sides)
    inertia = 10**exponent * axes @ np.diag(squares.sum() - squares) @ axes.T
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.Xform.Define(stage, "/body").GetPrim()
    make_rigid_body(prim, 1.0, np.zeros(3), (inertia + inertia.T) / 2)
    mass = UsdPhysics.MassAPI(prim)
    moments, quat_back = np.array(mass.GetDiagonalInertiaAttr().Get()), mass.GetPrincipalAxesAttr().Get()
    back = np.array(Gf.Matrix3d(Gf.Rotation(Gf.Quatd(quat_back)))).T
    assert relative_error(inertia, back @ np.diag(moments) @ back.T) < LIMIT
