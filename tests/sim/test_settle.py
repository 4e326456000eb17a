"""Settling: what rests is stored as it rests, and what does not is told apart."""

import numpy as np

from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.settle import SettleConfig, hold, measure_drift, settle
from tests.scene_fixtures import make_box_scene

CONFIG = SettleConfig()


def states(lift_m: float = 0.0, tilt_rad: float = 0.0) -> tuple[SceneBatch, np.ndarray]:
    """Slot 0 as stored; slot 1 with its target lifted or tilted."""
    scene, model = make_box_scene()
    poses = np.stack([scene.goal_pairs[0].object_poses] * 2)
    poses[1, 0, 2] += lift_m
    poses[1, 0, 3:] = [np.cos(tilt_rad / 2), np.sin(tilt_rad / 2), 0, 0]
    batch = SceneBatch([model, model], threads=1)
    batch.reset(np.arange(2), poses)
    return batch, poses


def test_settling_keeps_objects_on_the_table() -> None:
    batch, poses = states(lift_m=0.01)
    assert settle(batch, CONFIG).tolist() == [True, True]
    assert np.abs(batch.object_poses[:, :, 2] - poses[0, :, 2]).max() < 1e-3


def test_a_settled_state_holds_for_a_second() -> None:
    batch, _ = states(lift_m=0.01)
    settle(batch, CONFIG)
    drift = hold(batch, batch.object_poses.copy(), CONFIG)
    assert drift.distance_m.max() < 1e-3
    assert drift.angle_rad.max() < np.deg2rad(1)


def test_what_stands_on_its_edge_drifts_and_its_neighbours_do_not() -> None:
    batch, poses = states(lift_m=0.03, tilt_rad=0.6)
    drift = hold(batch, poses, CONFIG)
    assert drift.distance_m[1, 0] > 1e-2
    assert drift.distance_m[0].max() < 1e-3
    assert drift.distance_m[1, 1:].max() < 1e-3


def test_a_slot_settles_to_the_same_bits_beside_any_other_slot() -> None:
    beside_restless, _ = states(lift_m=0.03, tilt_rad=0.6)
    beside_calm, _ = states()
    settle(beside_restless, CONFIG)
    settle(beside_calm, CONFIG)
    np.testing.assert_array_equal(beside_restless.object_poses[0], beside_calm.object_poses[0])


def test_an_object_that_keeps_falling_never_settles() -> None:
    batch, poses = states()
    poses[1, 0, :3] = [2.0, 0.0, 0.5]
    batch.reset(np.arange(2), poses)
    assert settle(batch, CONFIG).tolist() == [True, False]


def test_drift_measures_distance_and_angle() -> None:
    before = np.array([[[0.0, 0, 0, 1, 0, 0, 0]]])
    after = np.array([[[0.03, 0.04, 0, np.cos(0.1), 0, 0, np.sin(0.1)]]])
    drift = measure_drift(before, after)
    np.testing.assert_allclose([drift.distance_m[0, 0], drift.angle_rad[0, 0]], [0.05, 0.2])
