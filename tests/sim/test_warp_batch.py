"""MuJoCo Warp against MuJoCo, without optimisation; the kernels are compiled in half a minute at first."""

import logging

import numpy as np
import pytest

from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS
from clutter6d.sim.warp_batch import WarpSceneBatch
from clutter6d.sim.warp_buffers import BufferSizes
from clutter6d.sim.warp_runtime import torch
from tests.scene_fixtures import make_box_scene
from tests.warp_fixtures import DEVICES, both_engines, compile_quickly, skip_without

SLOTS = 4
POSITION_TOLERANCE_M = 1e-4
SLIDING_TOLERANCE_M = 1e-3


@pytest.fixture(scope="module", params=DEVICES)
def device(request):
    compile_quickly()
    return skip_without(request.param)


@pytest.fixture(scope="module")
def made():
    return [make_box_scene(index) for index in range(SLOTS)]


@pytest.fixture(scope="module")
def engines(made, device):
    return both_engines([model for _, model in made], [scene.goal_pairs[1] for scene, _ in made], device)


def restart(engines, made):
    reference, batch = engines
    poses = np.stack([scene.goal_pairs[1].object_poses for scene, _ in made])
    batch.load(np.arange(SLOTS), [model for _, model in made])
    for each in engines:
        each.reset(np.arange(SLOTS), poses)
    return reference, batch


def command(engines, targets):
    reference, batch = engines
    reference.joint_targets[:] = targets
    batch.joint_targets[:] = torch.as_tensor(targets).to(batch.joint_targets)


def test_one_control_step_moves_arms_and_objects_as_mujoco_does(engines, made):
    reference, batch = restart(engines, made)
    offsets = generator(0, "warp").uniform(-0.1, 0.1, size=(SLOTS, 7))
    command(engines, HOME_QPOS + offsets)
    reference.object_velocities[:, 0, :3] = (0.3, 0.1, 0.0)
    batch.object_velocities[:, 0, :3] = torch.tensor([0.3, 0.1, 0.0])
    reference.step()
    batch.step()
    assert np.abs(reference.arm_qpos - HOME_QPOS).max() > 0.01
    assert np.abs(batch.arm_qpos.cpu().numpy() - reference.arm_qpos).max() < 1e-5
    difference = np.abs(batch.object_poses.cpu().numpy() - reference.object_poses)
    assert difference[:, 1:].max() < 1e-5
    assert difference[:, 0, :3].max() < SLIDING_TOLERANCE_M
    assert difference[:, 0, 3:].max() < 0.01


@pytest.mark.slow
def test_recording_a_control_step_does_not_make_one(made, device):
    batch = WarpSceneBatch([model for _, model in made], device=device)
    batch.reset(np.arange(SLOTS), np.stack([scene.goal_pairs[0].object_poses for scene, _ in made]))
    before = batch.save()
    batch._graph(20)
    after = batch.save()
    assert torch.equal(before.qpos, after.qpos)
    assert torch.equal(before.warm_start, after.warm_start)


def test_slots_that_are_not_stepped_stay_as_they_are(engines, made):
    _, batch = restart(engines, made)
    command(engines, HOME_QPOS + 0.05)
    before = batch.arm_qpos.clone()
    batch.step(np.array([1, 3]))
    moved = (batch.arm_qpos != before).any(dim=1).tolist()
    assert moved == [False, True, False, True]


def test_a_slot_can_be_given_another_scene(engines, made):
    reference, batch = restart(engines, made)
    scene, model = make_box_scene(9)
    for each in engines:
        each.load(np.array([2]), [model])
        each.reset(np.array([2]), scene.goal_pairs[0].object_poses[None])
        each.step()
    assert batch.scenes[2] is model
    difference = np.abs(batch.object_poses.cpu().numpy() - reference.object_poses)
    assert difference[..., :3].max() < POSITION_TOLERANCE_M


@pytest.mark.slow
def test_a_command_that_comes_late_is_followed_late(engines, made):
    reference, batch = restart(engines, made)
    delays = np.array([0, 5, 20, 40])
    before = np.tile(HOME_QPOS, (SLOTS, 1))
    command(engines, HOME_QPOS + 0.1)
    reference.step_delayed(np.arange(SLOTS), before, delays)
    batch.step_delayed(torch.as_tensor(before).to(batch.joint_targets), torch.as_tensor(delays, device=batch.device))
    assert np.abs(batch.arm_qpos.cpu().numpy() - reference.arm_qpos).max() < 1e-5
    assert np.abs(reference.arm_qpos[2:] - HOME_QPOS).max() < 1e-3 < np.abs(reference.arm_qpos[1] - HOME_QPOS).max()


def test_an_invalid_state_is_found_and_stays_in_its_slot(engines, made):
    reference, batch = restart(engines, made)
    batch.arm_qvel[1] = torch.nan
    reference.step()
    batch.step()
    assert batch.unstable_slots().tolist() == [1]
    others = [0, 2, 3]
    difference = np.abs(batch.object_poses.cpu().numpy() - reference.object_poses)[others]
    assert difference[..., :3].max() < POSITION_TOLERANCE_M
    batch.reset(np.array([1]), made[1][0].goal_pairs[1].object_poses[None])
    batch.step()
    assert not batch.is_unstable().any()


def test_a_buffer_that_is_too_small_is_reported_once_with_the_size_to_raise(made, device, caplog):
    sizes = BufferSizes(contacts=2, constraints=300)
    batch = WarpSceneBatch([model for _, model in made], device=device, sizes=sizes)
    batch.reset(np.arange(SLOTS), np.stack([scene.goal_pairs[0].object_poses for scene, _ in made]))
    with caplog.at_level(logging.WARNING):
        batch.step()
        batch.step()
    said = [record.getMessage() for record in caplog.records]
    assert len(said) == 1
    assert "raise BufferSizes.contacts from 2 to" in said[0]


@pytest.mark.slow
def test_objects_of_a_single_slot_rest_on_the_table(made, device):
    scene, model = made[0]
    batch = WarpSceneBatch([model], device=device)
    poses = scene.goal_pairs[0].object_poses
    batch.reset(np.array([0]), poses[None])
    batch.step()
    assert np.abs(batch.object_poses[0].cpu().numpy() - poses)[:, :3].max() < POSITION_TOLERANCE_M
