"""Scenes with other masses, frictions and table heights, and commands that arrive late."""

import numpy as np
import pytest

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.geometry import rotation_error_rad
from clutter6d.scene import GoalPair
from clutter6d.seeding import generator
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.kinematics import inverse_kinematics
from clutter6d.sim.model_variation import let_sleep, named_scales, raise_poses, table_height_m, vary_model
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.scene_model import SceneModel, compile_scene
from tests.scene_fixtures import make_box_asset, make_box_scene

DOWN = (0.0, 1.0, 0.0, 0.0)
"""The hand's orientation when its fingers point down, its palm's normal along x."""


def scaled(name: str, scene: SceneModel, factor: float) -> np.ndarray:
    return named_scales(scene.names, {name: factor})


def recompiled(scene: SceneModel, *, mass_scale: np.ndarray) -> SceneModel:
    """The same boxes, compiled from assets of the scaled masses."""
    assets = [
        make_box_asset(asset.name, asset.extents_m, mass_kg=asset.mass_properties.mass_kg * factor)
        for asset, factor in zip(scene.assets, mass_scale, strict=True)
    ]
    return compile_scene(list(zip(scene.names, assets, strict=True)))


def push_target(scenes: list[SceneModel], pair: GoalPair, *, steps: int = 12) -> np.ndarray:
    """Poses of all objects of all scenes while the hand sweeps the target along +y, one row a control step."""
    start, path = pair.initial.position, np.linspace(-0.12, 0.10, steps)
    hands = [[start[0], start[1] + y, start[2] + 0.11, *DOWN] for y in path]
    joints, reached = inverse_kinematics(np.array(hands), HOME_QPOS)
    assert reached.all()
    batch = SceneBatch(scenes, threads=1)
    batch.reset(np.arange(len(scenes)), np.stack([pair.object_poses] * len(scenes)), joints[0])
    poses = []
    for target in joints:
        batch.joint_targets[:] = target
        batch.step()
        poses.append(batch.object_poses.copy())
    return np.stack(poses, axis=1)


@pytest.fixture(scope="module")
def boxes() -> tuple[GoalPair, SceneModel]:
    scene, model = make_box_scene()
    return scene.goal_pairs[0], model


@pytest.fixture(scope="module")
def pushed(boxes) -> dict[str, np.ndarray]:
    """Trajectories of one push, by what was varied."""
    pair, model = boxes
    heavy = scaled("target", model, 8.0)
    scenes = {
        "as it is": model,
        "all scales one": vary_model(model, mass_scale=np.ones(4), friction_scale=np.ones(4), table_height_m=0.0),
        "heavy": vary_model(model, mass_scale=heavy),
        "compiled heavy": recompiled(model, mass_scale=heavy),
        "smooth": vary_model(model, friction_scale=scaled("target", model, 0.62)),
    }
    return dict(zip(scenes, push_target(list(scenes.values()), pair), strict=True))


def test_scales_of_one_change_nothing(pushed):
    assert np.array_equal(pushed["all scales one"], pushed["as it is"])


def test_a_varied_model_moves_as_one_compiled_from_an_asset_of_that_mass(pushed):
    moved = np.abs(pushed["heavy"][-1, 0, :3] - pushed["heavy"][0, 0, :3]).max()
    assert moved > 0.03, "the push must reach the target"
    np.testing.assert_allclose(pushed["heavy"], pushed["compiled heavy"], atol=1e-7)


def test_mass_and_friction_show_in_the_movement(pushed):
    plain, heavy, smooth = (pushed[name][:, 0] for name in ("as it is", "heavy", "smooth"))
    assert np.abs(plain - heavy).max() > 1e-3
    assert np.abs(plain - smooth).max() > 1e-3


def test_a_heavier_object_is_moved_less_by_the_same_blow(boxes):
    pair, model = boxes
    scenes = [vary_model(model, mass_scale=scaled("target", model, factor)) for factor in (1.0, 100.0)]
    batch = SceneBatch(scenes, threads=1)
    batch.reset(np.arange(2), np.stack([pair.object_poses] * 2))
    momentum = 0.3 * 1.0
    batch.object_velocities[:, 0, 1] = momentum / np.array([scene.object_masses_kg()[0] for scene in scenes])
    batch.step()
    light, heavy = np.abs(batch.object_poses[:, 0, :3] - pair.initial.position).max(axis=1)
    assert heavy < light / 50


def test_masses_frictions_and_derived_constants_are_those_of_a_compiled_model(boxes):
    _, model = boxes
    scale = np.array([100.0, 0.1, 1.0, 3.0])
    varied, compiled = vary_model(model, mass_scale=scale), recompiled(model, mass_scale=scale)
    np.testing.assert_allclose(varied.object_masses_kg(), 0.3 * scale)
    for name in ("body_inertia", "body_subtreemass", "body_invweight0", "dof_invweight0", "actuator_acc0"):
        np.testing.assert_allclose(getattr(varied.model, name), getattr(compiled.model, name), rtol=1e-9, err_msg=name)
    slippery = vary_model(model, friction_scale=np.array([0.5, 1, 1, 2.0]))
    np.testing.assert_allclose(slippery.object_frictions(), [0.25, 0.5, 0.5, 1.0])
    np.testing.assert_allclose(model.object_frictions(), 0.5, err_msg="the original was changed")


def test_objects_that_may_sleep_stand_still_and_are_pushed_as_those_that_may_not(boxes, pushed):
    pair, model = boxes
    (sleepy,) = push_target([let_sleep(model)], pair)
    plain = pushed["as it is"]
    assert np.abs(sleepy[-1, 0, :3] - sleepy[0, 0, :3]).max() > 0.03
    np.testing.assert_allclose(sleepy[..., :3], plain[..., :3], atol=2e-3)
    others, awake = sleepy[2:, 2:], plain[2:, 2:]
    assert (others == others[0]).all(), "untouched objects move while they sleep"
    assert not (awake == awake[0]).all()


def test_letting_objects_sleep_leaves_the_scene_as_it_was(boxes):
    _, model = boxes
    flags = model.model.opt.enableflags
    assert let_sleep(model).model.opt.enableflags != flags
    assert model.model.opt.enableflags == flags


def test_objects_rest_on_a_moved_table(boxes):
    pair, model = boxes
    heights = np.array([-0.03, 0.0, 0.04])
    scenes = [vary_model(model, table_height_m=float(height)) for height in heights]
    assert [round(table_height_m(scene.model), 9) for scene in scenes] == heights.tolist()
    poses = np.stack([raise_poses(pair.object_poses, float(height)) for height in heights])
    batch = SceneBatch(scenes, threads=1)
    batch.reset(np.arange(3), poses)
    for _ in range(10):
        batch.step()
    np.testing.assert_allclose(batch.object_poses[..., :3], poses[..., :3], atol=1e-3)
    assert rotation_error_rad(batch.object_poses[..., 3:], poses[..., 3:]).max() < 0.01


def test_raising_moves_poses_up_and_nothing_else(boxes):
    poses = np.stack([boxes[0].object_poses] * 2)
    raised = raise_poses(poses, np.array([[0.1], [-0.1]]))
    np.testing.assert_allclose(raised[0, :, 2] - raised[1, :, 2], 0.2)
    assert np.array_equal(np.delete(raised, 2, axis=-1), np.delete(poses, 2, axis=-1))


@pytest.mark.parametrize("scale", [np.ones(3), np.array([1, 1, 0, 1.0]), np.array([1, np.nan, 1, 1])])
def test_scales_that_make_no_body_are_refused(boxes, scale):
    with pytest.raises(InvalidValueError, match="one positive number for each of the 4 objects"):
        vary_model(boxes[1], mass_scale=scale)


def test_names_that_are_not_in_the_scene_are_refused(boxes):
    with pytest.raises(UnknownNameError, match="unknown object 'large_1'; did you mean 'large_0'"):
        named_scales(boxes[1].names, {"large_1": 100.0})


def moving_batch(boxes, threads: int) -> SceneBatch:
    pair, model = boxes
    batch = SceneBatch([model] * 3, threads=threads)
    batch.reset(np.arange(3), np.stack([pair.object_poses] * 3))
    batch.joint_targets[:] = HOME_QPOS + generator(0, "targets").uniform(-0.1, 0.1, size=(3, 7))
    return batch


@pytest.mark.parametrize("threads", [1, 2])
def test_without_delay_a_delayed_step_is_a_step_to_the_bit(boxes, threads):
    plain, delayed = moving_batch(boxes, threads), moving_batch(boxes, 1)
    slots = np.array([0, 2])
    for _ in range(3):
        plain.step(slots)
        delayed.step_delayed(slots, np.zeros((2, 7)), np.zeros(2, dtype=int))
    assert np.array_equal(plain.states, delayed.states)


def test_a_delayed_step_follows_the_old_target_first(boxes):
    batch, by_hand = moving_batch(boxes, 1), moving_batch(boxes, 1)
    old, new = np.tile(HOME_QPOS, (3, 1)), by_hand.joint_targets.copy()
    delays = np.array([0, 7, 20])
    batch.step_delayed(np.arange(3), old, delays)
    for slot, delay in enumerate(delays):
        for targets, steps in ((old, delay), (new, 20 - delay)):
            by_hand.joint_targets[slot] = targets[slot]
            if steps:
                by_hand.step(np.array([slot]), physics_steps=int(steps))
    assert np.array_equal(batch.arm_qpos, by_hand.arm_qpos)
    assert np.array_equal(batch.object_poses, by_hand.object_poses)
    assert np.array_equal(batch.joint_targets, new)
