"""Menagerie's meshes dress the robot when they are on the machine, and nothing is ever downloaded."""

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import mujoco
import numpy as np
import pytest

from clutter6d.sim.menagerie import cached_model_path
from clutter6d.sim.robot import add_robot

MODEL = """
<mujoco>
  <asset>
    <material name="red" rgba="1 0 0 1"/>
    <mesh name="wedge" vertex="0 0 0  0.1 0 0  0 0.2 0  0 0 0.3"/>
  </asset>
  <worldbody>
    <body name="fr3_link0">
      <geom type="mesh" mesh="wedge" material="red" contype="0" conaffinity="0" pos="0.01 0.02 0.03"/>
      <geom type="mesh" mesh="wedge"/>
      <body name="fr3_link1"><joint/><geom type="mesh" mesh="wedge" contype="0" conaffinity="0"/></body>
      <body name="unknown"><geom type="mesh" mesh="wedge" contype="0" conaffinity="0"/></body>
    </body>
  </worldbody>
</mujoco>
"""


@dataclass
class FakeRobot:
    """A robot as the package describes it; asking it for its path would download."""

    name: str = "franka_fr3"
    default_model: str = "fr3"

    def entry(self, name):
        assert name == "fr3"
        return type("EntryPoint", (), {"file": "fr3.xml"})

    def path(self, *arguments):
        raise AssertionError("this would download")

    xml = model = spec = path


@pytest.fixture
def menagerie(monkeypatch, tmp_path) -> Path:
    """A stand-in for the package with a cache folder below ``tmp_path``."""

    class FakeCache:
        root = None

        def model_path(self, robot):
            return tmp_path / "models" / robot.name

        def is_cached(self, robot):
            return (self.model_path(robot) / ".complete").is_file()

    package = ModuleType("mujoco_menagerie")
    package.Cache, package.get = FakeCache, lambda name: FakeRobot(name=name)
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", package)
    return tmp_path / "models" / "franka_fr3"


def fill(folder: Path, text: str = MODEL) -> None:
    folder.mkdir(parents=True)
    (folder / "fr3.xml").write_text(text)
    (folder / ".complete").write_text("{}")


def visual_geoms(spec: mujoco.MjSpec, body: str) -> list[str]:
    return [geom.name for geom in spec.body(body).geoms if geom.group == 2]


def dressed_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    add_robot(spec, visuals=True)
    return spec


def test_without_the_package_the_robot_has_its_own_look(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", None)
    assert cached_model_path() is None
    assert visual_geoms(dressed_spec(), "fr3_link0")[0] == "fr3_link0_visual0"


def test_a_model_that_is_not_in_the_cache_is_not_downloaded(menagerie):
    assert cached_model_path() is None
    menagerie.mkdir(parents=True)
    (menagerie / "fr3.xml").write_text(MODEL)
    assert cached_model_path() is None, "an unfinished download is not used"


def test_cached_meshes_replace_the_look_of_the_links_they_cover(menagerie):
    fill(menagerie)
    spec = dressed_spec()
    assert visual_geoms(spec, "fr3_link0") == ["fr3_link0_menagerie0"]
    assert all("menagerie" in name for name in visual_geoms(spec, "fr3_link1"))
    assert visual_geoms(spec, "hand")[0] == "hand_visual0"
    model = spec.compile()
    assert model.nv == 7


def test_a_copied_mesh_is_where_menagerie_has_it(menagerie):
    fill(menagerie)
    model = dressed_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = model.geom("fr3_link0_menagerie0")
    np.testing.assert_allclose(model.geom_rgba[geom.id], [1, 0, 0, 1])
    mesh = geom.dataid[0]
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] : model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh]]
    world = vertices @ data.geom_xmat[geom.id].reshape(3, 3).T + data.geom_xpos[geom.id]
    in_body = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, 0.3]])
    body_origin = np.array([0.01 - 0.60, 0.02, 0.03])
    distance = np.linalg.norm(world[:, None] - (in_body + body_origin), axis=-1).min(axis=0)
    np.testing.assert_allclose(distance, 0, atol=1e-6)


def test_a_damaged_model_leaves_the_built_in_look(menagerie, caplog):
    fill(menagerie, "<mujoco><nonsense/></mujoco>")
    assert visual_geoms(dressed_spec(), "fr3_link0")[0] == "fr3_link0_visual0"
    assert "cannot be read" in caplog.text


def test_a_package_of_another_make_is_not_trusted(monkeypatch, caplog):
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", ModuleType("mujoco_menagerie"))
    assert cached_model_path() is None
    assert "not understood" in caplog.text
