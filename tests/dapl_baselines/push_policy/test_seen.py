import numpy as np
import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from dapl_baselines.push_policy.push_slots import PushSlots
from dapl_baselines.push_policy.seen import fit_normals, fit_velocities, see_points
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.validation import part_scenes
from tests.dapl_baselines.push_policy.drawn import make_push
from tests.scene_fixtures import make_box_scene_set


@pytest.fixture
def slots() -> PushSlots:
    """Three slots a few steps after a push of each began."""
    scenes = part_scenes(make_box_scene_set(3)).training
    shapes = TargetShapes.of(scenes.assets_of(scene)[scene.objects[0].asset_hash] for scene in scenes.scenes)
    made = PushSlots(scenes, shapes, EnvConfig(), size=3, seed=0, threads=1)
    pushes = np.stack([make_push(1.0), make_push(-1.0), make_push(1.0)])
    made.tracker.begin(np.arange(3), pushes, made.see().state.poses[:, :3])
    for _ in range(24):
        made.step(made.see(), np.ones(3, dtype=bool))
    return made


def test_points_tell_what_the_simulation_knows(slots):
    known, seen = slots.see(), see_points(slots.observe(np.arange(3)))
    np.testing.assert_allclose(seen.state.poses[:, :3], known.state.poses[:, :3], atol=4e-3)
    np.testing.assert_allclose(seen.state.physics[:, 0], known.state.physics[:, 0], rtol=1e-5)
    for name in ("tips", "tip_velocities", "hands"):
        np.testing.assert_allclose(getattr(seen.state, name), getattr(known.state, name), atol=1e-5)
    np.testing.assert_allclose(seen.state.velocities[:, 3:], known.state.velocities[:, 3:], atol=1e-3)
    np.testing.assert_allclose(seen.qvel, known.qvel, atol=1e-6)
    assert np.abs(known.state.velocities).max() > 0.01


def test_the_goal_takes_the_points_to_where_the_simulation_would(slots):
    known, seen = slots.see(), see_points(slots.observe(np.arange(3)))
    goals = quat_to_matrix(seen.goals[:, 3:])
    there = seen.shapes.surface @ goals.transpose(0, 2, 1) + seen.goals[:, None, :3]
    placed = seen.shapes.surface + seen.state.poses[:, None, :3] - known.state.poses[:, None, :3]
    local = placed @ quat_to_matrix(known.state.poses[:, 3:])
    wanted = local @ quat_to_matrix(known.goals[:, 3:]).transpose(0, 2, 1) + known.goals[:, None, :3]
    np.testing.assert_allclose(there, wanted, atol=8e-3)


def test_normals_of_a_box_are_those_of_its_faces(slots):
    seen = see_points(slots.observe(np.arange(3)))
    to_box = quat_to_matrix(slots.see().state.poses[:, 3:])
    normals, contacts = seen.shapes.normals @ to_box, seen.shapes.contacts @ to_box
    half = np.abs(contacts).max(axis=1, keepdims=True)
    # Near an edge the fit mixes two faces.
    is_inner = (half - np.abs(contacts)).min(axis=-1) < 1e-3
    is_inner &= np.sort(half - np.abs(contacts), axis=-1)[..., 1] > 0.02
    outward = (np.abs(normals).argmax(axis=-1) == (half - np.abs(contacts)).argmin(axis=-1))[is_inner]
    assert is_inner.sum() > 10
    assert outward.mean() > 0.9
    assert ((normals * contacts).sum(axis=-1)[is_inner] > 0).mean() > 0.95


def test_without_normals_nothing_else_changes(slots):
    observation = slots.observe(np.arange(3))
    with_normals, without = see_points(observation), see_points(observation, has_normals=False)
    assert not without.shapes.normals.any()
    np.testing.assert_array_equal(with_normals.points_in_the_way(), without.points_in_the_way())
    np.testing.assert_array_equal(with_normals.state.poses, without.state.poses)


def test_what_points_show_in_the_way_is_there_and_near(slots):
    known, seen = (each.points_in_the_way() for each in (slots.see(), see_points(slots.observe(np.arange(3)))))
    distances = np.linalg.norm(seen[:, :, None] - known[:, None], axis=-1).min(axis=2)
    assert distances.mean() < 0.02
    assert distances.max() < 0.06
    assert (seen[:, 64:] != seen[:, :1]).any(axis=2).all()


def test_the_velocity_of_a_rigid_body_is_found_from_its_points():
    rng = generator(0, "rigid")
    offsets = rng.normal(size=(5, 40, 3)) * 0.05
    offsets -= offsets.mean(axis=1, keepdims=True)
    linear, angular = rng.normal(size=(2, 5, 1, 3))
    found = fit_velocities(offsets, linear + np.cross(angular, offsets))
    np.testing.assert_allclose(found, np.concatenate([linear, angular], axis=-1)[:, 0], atol=1e-5)


def test_a_thin_wall_has_normals_on_both_sides():
    grid = np.stack(np.meshgrid(np.linspace(-0.05, 0.05, 11), np.linspace(-0.05, 0.05, 11)), axis=-1).reshape(-1, 2)
    sides = [np.column_stack([grid, np.full(len(grid), height)]) for height in (0.05, 0.056)]
    middle = np.array([[[0.0, 0.0, 0.05], [0.0, 0.0, 0.056]]])
    normals = fit_normals(middle, np.concatenate(sides)[None])
    np.testing.assert_allclose(normals, [[[0, 0, -1], [0, 0, 1]]], atol=0.15)
