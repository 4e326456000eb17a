"""USD export: the layout that engines rely on, valid by USD's own validators, and the same bytes every time."""

from pathlib import Path

import numpy as np
import pytest
from check_usd_parity import validator_reports
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade

from clutter6d.export.usd import export_usd, export_usdz
from clutter6d.export.usd_prims import unique_identifiers
from tests.export.export_fixtures import LICENCE_NAME, crooked_scene


@pytest.fixture(scope="module")
def usd(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_usd(*crooked_scene(), tmp_path_factory.mktemp("usd"))


@pytest.fixture
def stage(usd: Path) -> Usd.Stage:
    return Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(usd)))


def prims_with(stage: Usd.Stage, schema: type) -> list[Usd.Prim]:
    return [prim for prim in stage.Traverse() if prim.HasAPI(schema)]


def test_usds_own_validators_report_nothing(usd: Path) -> None:
    assert validator_reports(usd) == []


def test_the_validators_would_report_a_faulty_scene(usd: Path, tmp_path: Path) -> None:
    stage = Usd.Stage.Open(Sdf.Layer.OpenAsAnonymous(str(usd)))
    stage.GetPrimAtPath("/World/table/top").RemoveAPI(UsdShade.MaterialBindingAPI)
    UsdPhysics.RevoluteJoint.Get(stage, "/World/robot/joints/fr3_joint1").GetBody0Rel().SetTargets(["/World/nobody"])
    stage.GetRootLayer().ClearDefaultPrim()
    assert stage.GetRootLayer().Export(str(tmp_path / "faulty.usd"))
    reports = " ".join(validator_reports(tmp_path / "faulty.usd"))
    for word in ("/World/table/top", "fr3_joint1", "defaultPrim"):
        assert word in reports


def test_units_are_metres_and_kilograms_and_z_is_up(stage: Usd.Stage) -> None:
    assert UsdGeom.GetStageMetersPerUnit(stage) == UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert stage.GetDefaultPrim().GetPath() == "/World"


def test_every_object_is_one_rigid_body_with_explicit_mass(stage: Usd.Stage) -> None:
    scene, _ = crooked_scene()
    bodies = stage.GetPrimAtPath("/World/objects").GetChildren()
    assert [prim.GetName() for prim in bodies] == [item.name for item in scene.objects]
    for body in bodies:
        assert [prim for prim in Usd.PrimRange(body) if prim.HasAPI(UsdPhysics.RigidBodyAPI)] == [body]
        mass = UsdPhysics.MassAPI(body)
        for attribute in (mass.GetMassAttr(), mass.GetCenterOfMassAttr(), mass.GetDiagonalInertiaAttr()):
            assert attribute.HasAuthoredValue()


def test_every_convex_part_is_one_collider_that_renderers_leave_out(stage: Usd.Stage) -> None:
    scene, assets = crooked_scene()
    for item in scene.objects:
        body = stage.GetPrimAtPath(f"/World/objects/{item.name}")
        colliders = [prim for prim in Usd.PrimRange(body) if prim.HasAPI(UsdPhysics.CollisionAPI)]
        assert len(colliders) == len(assets[item.asset_hash].parts)
        for prim in colliders:
            assert UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get() == "convexHull"
            assert UsdGeom.Imageable(prim).ComputePurpose() == "guide"


def test_what_is_seen_has_a_preview_surface_in_its_colour(stage: Usd.Stage) -> None:
    scene, assets = crooked_scene()
    for number, visual in enumerate(assets[scene.target.asset_hash].visual):
        mesh = stage.GetPrimAtPath(f"/World/objects/target/visual/mesh_{number}")
        assert UsdGeom.Imageable(mesh).ComputePurpose() == "default"
        material = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()[0]
        shader = material.ComputeSurfaceSource()[0]
        assert shader.GetIdAttr().Get() == "UsdPreviewSurface"
        assert shader.GetInput("opacity").Get() == visual.rgba[3]
        shown = np.array(shader.GetInput("diffuseColor").Get()) ** (1 / 2.2)
        np.testing.assert_allclose(shown, visual.rgba[:3], atol=0.04)


def test_nothing_seen_collides(stage: Usd.Stage) -> None:
    seen = [prim for prim in stage.Traverse() if "visual" in str(prim.GetPath())]
    assert seen
    assert not [prim for prim in seen if prim.HasAPI(UsdPhysics.CollisionAPI)]


def test_the_robot_is_one_articulation_fixed_to_its_frame(stage: Usd.Stage) -> None:
    assert [prim.GetPath() for prim in prims_with(stage, UsdPhysics.ArticulationRootAPI)] == ["/World/robot"]
    joints = [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]
    assert sum(joint.GetPrim().IsA(UsdPhysics.RevoluteJoint) for joint in joints) == 7
    base = UsdPhysics.Joint.Get(stage, "/World/robot/joints/fr3_link0_fixed")
    assert base.GetBody0Rel().GetTargets() == ["/World/robot"]
    held = [str(joint.GetBody1Rel().GetTargets()[0]) for joint in joints]
    links = [prim for prim in stage.GetPrimAtPath("/World/robot").GetChildren() if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    assert sorted(held) == sorted(str(link.GetPath()) for link in links)


def test_the_joints_hold_the_links_where_they_are(stage: Usd.Stage) -> None:
    """At home, both frames of a revolute joint differ by its drive's target about its axis alone."""
    cache = UsdGeom.XformCache()
    for prim in stage.GetPrimAtPath("/World/robot/joints").GetChildren():
        joint, drive = UsdPhysics.Joint(prim), UsdPhysics.DriveAPI(prim, "angular")
        frames = []
        for bodies, position, rotation in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            local = Gf.Matrix4d(Gf.Rotation(Gf.Quatd(rotation.Get())), Gf.Vec3d(position.Get()))
            frames.append(local * cache.GetLocalToWorldTransform(stage.GetPrimAtPath(bodies.GetTargets()[0])))
        angle = drive.GetTargetPositionAttr().Get() if drive else 0.0
        turned = Gf.Matrix4d(Gf.Rotation(Gf.Vec3d.ZAxis(), angle), Gf.Vec3d(0)) * frames[0]
        np.testing.assert_allclose(np.array(turned), np.array(frames[1]), atol=1e-6)


def test_the_robot_does_not_touch_itself(stage: Usd.Stage) -> None:
    group = UsdPhysics.CollisionGroup.Get(stage, "/World/robot/no_self_contact")
    assert group.GetFilteredGroupsRel().GetTargets() == [group.GetPath()]
    members = group.GetCollidersCollectionAPI().ComputeMembershipQuery()
    robot = Usd.PrimRange(stage.GetPrimAtPath("/World/robot"))
    assert all(members.IsPathIncluded(prim.GetPath()) for prim in robot if prim.HasAPI(UsdPhysics.CollisionAPI))
    assert not members.IsPathIncluded(Sdf.Path("/World/table/top"))


def test_the_table_is_static(stage: Usd.Stage) -> None:
    table = stage.GetPrimAtPath("/World/table")
    bodies = [prim for prim in Usd.PrimRange(table) if prim.HasAPI(UsdPhysics.RigidBodyAPI)]
    colliders = [prim for prim in Usd.PrimRange(table) if prim.HasAPI(UsdPhysics.CollisionAPI)]
    assert (len(bodies), len(colliders)) == (0, 1)


def test_a_variant_chooses_the_goal_pair(stage: Usd.Stage) -> None:
    scene, _ = crooked_scene()
    pairs = stage.GetDefaultPrim().GetVariantSet("goal_pair")
    assert pairs.GetVariantNames() == [f"pair_{number}" for number in range(len(scene.goal_pairs))]
    assert pairs.GetVariantSelection() == "pair_0"
    for number, pair in enumerate(scene.goal_pairs):
        pairs.SetVariantSelection(f"pair_{number}")
        goal = UsdGeom.Xformable(stage.GetPrimAtPath("/World/goal"))
        found = goal.ComputeLocalToWorldTransform(Usd.TimeCode.Default()).ExtractTranslation()
        np.testing.assert_allclose(found, pair.goal.position)


def test_the_goals_ghost_is_the_targets_shape_and_touches_nothing(stage: Usd.Stage) -> None:
    ghost = [prim for prim in Usd.PrimRange(stage.GetPrimAtPath("/World/goal")) if prim.IsA(UsdGeom.Mesh)]
    assert len(ghost) == 2
    for prim in ghost:
        assert UsdGeom.Imageable(prim).ComputePurpose() == "guide"
        assert not prim.HasAPI(UsdPhysics.CollisionAPI)
        colour = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
        assert colour.GetPath() == "/World/goal/look"


def test_graph_pairs_certificate_and_licences_are_custom_data(stage: Usd.Stage) -> None:
    scene, _ = crooked_scene()
    told = stage.GetDefaultPrim().GetCustomDataByKey("clutter6d")
    assert (told["sceneId"], told["track"], told["target"]) == (scene.scene_id, scene.track, "target")
    assert list(told["sceneGraph"]["subjects"]) == [relation.subject for relation in scene.graph.relations]
    assert list(told["goalPairs"]["pair_1"]["goal"]) == scene.goal_pairs[1].goal.as_row().tolist()
    assert told["certificate"]["relationsHold"] == scene.certificate.relations_hold
    target = stage.GetPrimAtPath("/World/objects/target").GetCustomDataByKey("clutter6d")
    assert (target["licence"]["name"], target["licence"]["author"]) == (LICENCE_NAME, "A. Potter")


def test_licences_lie_beside_the_file(usd: Path) -> None:
    assert LICENCE_NAME in (usd.parent / "LICENCES.csv").read_text()


def test_a_stage_that_refers_to_the_scene_keeps_its_own_physics(usd: Path) -> None:
    stage = Usd.Stage.CreateInMemory()
    for number in range(2):
        stage.DefinePrim(f"/World/envs/env_{number}/Scene").GetReferences().AddReference(str(usd))
    assert not [prim for prim in stage.Traverse() if prim.IsA(UsdPhysics.Scene)]
    for prim in stage.Traverse():
        for relation in prim.GetRelationships():
            for path in relation.GetTargets():
                assert stage.GetPrimAtPath(path.GetPrimPath()), f"{relation.GetPath()} refers to {path}"
                assert str(path).startswith(str(prim.GetPath())[:17]), "relations stay within their environment"


def test_equal_scenes_give_equal_bytes(usd: Path, tmp_path: Path) -> None:
    assert export_usd(*crooked_scene(), tmp_path).read_bytes() == usd.read_bytes()
    packages = [export_usdz(*crooked_scene(), tmp_path / name).read_bytes() for name in ("a", "b")]
    assert packages[0] == packages[1]


def test_the_package_is_valid_and_holds_the_same_scene(usd: Path, tmp_path: Path) -> None:
    package = export_usdz(*crooked_scene(), tmp_path)
    assert validator_reports(package) == []
    inside, outside = (Usd.Stage.Open(str(path)) for path in (package, usd))
    assert inside.ExportToString(addSourceFileComment=False) == outside.ExportToString(addSourceFileComment=False)


def test_names_become_identifiers_without_falling_together() -> None:
    assert unique_identifiers(["mug-1", "mug.1", "1", "mug_1"]) == {
        "mug-1": "mug_1",
        "mug.1": "mug_1_1",
        "1": "_1",
        "mug_1": "mug_1_2",
    }
