"""Errors in what a policy observes: how large, how long, and where they must not be."""

from dataclasses import fields, replace
from typing import cast

import numpy as np
import pytest

from clutter6d.envs.noise import DISTILLATION_NOISE, SENSITIVITY_LEVELS, NoiseConfig, sensitivity_noise
from clutter6d.envs.observation import (
    BodyState,
    Observation,
    TaskArrays,
    make_observation,
)
from clutter6d.envs.observation_noise import ObservationNoise
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.geometry import quat_normalize, rotation_error_rad
from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS
from tests.scene_fixtures import make_box_scene

SLOTS, OBJECTS = 6, 4
ALL = np.arange(SLOTS)
EVERYTHING = replace(sensitivity_noise("all", 0.25), coordinates_m=0.05, velocities_m_s=0.05)


def make_inputs(slots: int = SLOTS) -> tuple[BodyState, TaskArrays]:
    """Slot i runs box scene i, pair 1; everything moves."""
    task, poses = TaskArrays.allocate(slots, OBJECTS), np.empty((slots, OBJECTS, 7))
    for slot in range(slots):
        scene, model = make_box_scene(slot)
        task.load(slot, model, scene.goal_pairs[1].goal)
        poses[slot] = scene.goal_pairs[1].object_poses
    rng = generator(0, "moving")
    poses[..., 3:] = quat_normalize(poses[..., 3:] + 0.2 * rng.normal(size=(slots, OBJECTS, 4)))
    state = BodyState(
        arm_qpos=np.tile(HOME_QPOS, (slots, 1)),
        arm_qvel=np.zeros((slots, 7)),
        object_poses=poses,
        object_velocities=rng.normal(size=(slots, OBJECTS, 6)) * [0.1, 0.1, 0.1, 1, 1, 1],
    )
    return state, task


def make_noise(config: NoiseConfig, slots: int = SLOTS, *, episode: int = 0, first: int = 0) -> ObservationNoise:
    noise = ObservationNoise(config, slots, OBJECTS)
    for slot in range(slots):
        scene, model = make_box_scene(first + slot)
        pair = scene.goal_pairs[1]
        noise.start(
            slot,
            generator(0, "noise", first + slot, episode),
            masses_kg=model.object_masses_kg(),
            initial=pair.initial.as_row(),
            goal=pair.goal.as_row(),
        )
    return noise


def observe(state: BodyState, task: TaskArrays) -> Observation:
    return make_observation(state, task, np.zeros((len(state.arm_qpos), 7), dtype=np.float32))


def steps(number: int, slots: int = SLOTS) -> np.ndarray:
    return np.full(slots, number)


def test_no_noise_hands_the_very_arguments_back():
    state, task = make_inputs()
    noise, observation = make_noise(NoiseConfig()), observe(state, task)
    assert noise.disturb_inputs(ALL, steps(0), state, task) == (state, task)
    assert noise.disturb_points(ALL, steps(0), observation) is observation


def test_what_is_true_stays_as_it_is():
    state, task = make_inputs()
    before = [array.copy() for array in (state.object_velocities, task.goals, task.physics, task.clouds.point_mass)]
    observation = observe(state, task)
    seen = {name: value.copy() for name, value in cast(dict, observation).items()}
    noise = make_noise(EVERYTHING)
    noise.disturb_inputs(ALL, steps(3), state, task)
    noise.disturb_points(ALL, steps(3), observation)
    after = [state.object_velocities, task.goals, task.physics, task.clouds.point_mass]
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))
    assert all(np.array_equal(seen[name], value) for name, value in cast(dict, observation).items())


def test_a_slots_noise_is_its_own_in_any_company_and_order():
    state, task = make_inputs()
    many, alone = make_noise(EVERYTHING), make_noise(EVERYTHING, 1, first=4)
    row = slice(4, 5)
    alone.disturb_inputs(np.array([0]), np.array([9]), state[row], task[row])
    for noise, slots, part in ((many, ALL, slice(None)), (alone, np.array([0]), row)):
        wrong = noise.disturb_inputs(slots, steps(7, len(slots)), state[part], task[part])
        shown = noise.disturb_points(slots, steps(7, len(slots)), observe(*wrong))
        if noise is many:
            expected = {name: value[row] for name, value in cast(dict, shown).items()}
        else:
            assert all(np.array_equal(expected[name], value) for name, value in cast(dict, shown).items())


def test_another_episode_is_wrong_in_another_way():
    state, task = make_inputs()
    first, second = (make_noise(EVERYTHING, episode=e).disturb_inputs(ALL, steps(0), state, task) for e in (0, 1))
    assert not np.isclose(first[1].clouds.point_mass, second[1].clouds.point_mass).any()
    assert not np.isclose(first[1].goals[:, :3], second[1].goals[:, :3]).any()


def test_masses_are_wrong_for_the_whole_episode_and_the_same_everywhere():
    state, task = make_inputs()
    noise = make_noise(sensitivity_noise("mass", 0.25))
    seen = [observe(*noise.disturb_inputs(ALL, steps(step), state, task)) for step in (0, 150)]
    assert np.array_equal(seen[0]["object_points"], seen[1]["object_points"])
    assert np.array_equal(seen[0]["physics_parameters"], seen[1]["physics_parameters"])
    target = seen[0]["object_points"][..., 3].sum(axis=1)
    np.testing.assert_allclose(target, seen[0]["physics_parameters"][:, 0], rtol=1e-5)
    true = observe(state, task)
    unlike = [name for name, value in cast(dict, true).items() if not np.array_equal(value, cast(dict, seen[0])[name])]
    assert unlike == ["object_points", "environment_points", "physics_parameters"]
    assert np.array_equal(true["physics_parameters"][:, 1:], seen[0]["physics_parameters"][:, 1:])


def test_the_error_of_masses_is_the_share_of_their_mean():
    """Many objects, so that their errors can be counted."""
    noise = ObservationNoise(sensitivity_noise("mass", 0.05), 1, 4000)
    masses = generator(0, "masses").uniform(0.3, 3.0, size=4000)
    noise.start(0, generator(0, "noise"), masses_kg=masses, initial=np.eye(7)[3], goal=np.eye(7)[3])
    state, task = make_inputs(1)
    clouds = replace(
        task.clouds, points=np.zeros((1, 4000, 3, 512), np.float32), point_mass=masses[None].astype(np.float32)
    )
    task = replace(task, clouds=clouds)
    estimate = noise.disturb_inputs(np.array([0]), steps(0, 1), state, task)[1].clouds.point_mass[0]
    assert np.std(estimate - masses) == pytest.approx(0.05 * masses.mean(), rel=0.05)
    assert np.mean(estimate - masses) == pytest.approx(0, abs=0.01)


def test_a_light_object_among_heavy_ones_keeps_a_mass():
    noise = ObservationNoise(sensitivity_noise("mass", 0.5), 1, 4)
    state, task = make_inputs(1)
    for episode in range(50):
        masses = np.array([0.01, 3.0, 3.0, 3.0])
        noise.start(0, generator(0, episode), masses_kg=masses, initial=np.eye(7)[3], goal=np.eye(7)[3])
        estimate = noise.disturb_inputs(np.array([0]), steps(0, 1), state, task)[1].clouds.point_mass
        assert (estimate >= 0.0999 * task.clouds.point_mass).all()


def test_bodies_seen_with_wrong_velocities_are_rigid():
    """Points of a rigid body have velocities ``v + w x p``: six numbers explain all 1536."""
    state, task = make_inputs()
    wrong = make_noise(sensitivity_noise("velocity", 0.5)).disturb_inputs(ALL, steps(0), state, task)
    true, seen = observe(state, task), observe(*wrong)
    error = (seen["object_points"] - true["object_points"]).astype(np.float64)
    assert not error[..., :4].any(), "positions and masses are right"
    for points, wrong_by in zip(true["object_points"].astype(np.float64), error[..., 4:], strict=True):
        x, y, z = points[:, :3].T
        none, one = np.zeros_like(x), np.ones_like(x)
        columns = [(one, none, none), (none, one, none), (none, none, one)]
        columns += [(none, -z, y), (z, none, -x), (-y, x, none)]
        matrix = np.stack([np.stack(column, axis=1).ravel() for column in columns], axis=1)
        left = wrong_by.ravel() - matrix @ np.linalg.lstsq(matrix, wrong_by.ravel())[0]
        assert np.abs(left).max() < 1e-5 < np.abs(wrong_by).max()


def all_velocities(state: BodyState, task: TaskArrays) -> np.ndarray:
    """Velocities of every object's points, by taking each object for the target in turn."""
    seen = []
    for index in range(OBJECTS):
        order = np.roll(np.arange(OBJECTS), -index)
        turned = replace(
            state, object_poses=state.object_poses[:, order], object_velocities=state.object_velocities[:, order]
        )
        clouds = replace(task.clouds, points=task.clouds.points[:, order], point_mass=task.clouds.point_mass[:, order])
        seen.append(observe(turned, replace(task, clouds=clouds))["object_points"][..., 4:])
    return np.stack(seen, axis=1).astype(np.float64)


def test_the_error_of_velocities_is_the_share_of_the_mean_speed():
    state, task = make_inputs()
    noise, true = make_noise(sensitivity_noise("velocity", 0.25)), all_velocities(state, task)
    errors = np.stack(
        [all_velocities(*noise.disturb_inputs(ALL, steps(step), state, task)) - true for step in range(60)]
    )
    mean_speed = np.linalg.norm(true, axis=-1).mean(axis=(1, 2))
    length = np.sqrt((errors**2).sum(axis=-1).mean(axis=(0, 2, 3)))
    np.testing.assert_allclose(length, 0.25 * mean_speed, rtol=0.12)
    assert np.abs(errors.mean(axis=0)).max() < 0.25 * mean_speed.max(), "drawn anew at every step"


def test_a_scene_at_rest_is_seen_at_rest():
    state, task = make_inputs()
    still = replace(state, object_velocities=np.zeros_like(state.object_velocities))
    seen, _ = make_noise(sensitivity_noise("velocity", 0.5)).disturb_inputs(ALL, steps(0), still, task)
    assert not seen.object_velocities.any()


def test_the_goal_seen_is_a_pose_whose_error_is_the_share_of_the_way_at_the_start():
    state, task = make_inputs()
    noise = make_noise(sensitivity_noise("goal_pose", 0.05))
    seen = np.stack([noise.disturb_inputs(ALL, steps(step), state, task)[1].goals for step in range(400)])
    np.testing.assert_allclose(np.linalg.norm(seen[..., 3:], axis=-1), 1, atol=1e-12)
    way = [make_box_scene(slot)[0].goal_pairs[1] for slot in range(SLOTS)]
    distance = [np.linalg.norm(np.subtract(pair.goal.position, pair.initial.position)) for pair in way]
    offset = np.sqrt(((seen - task.goals)[..., :3] ** 2).sum(axis=-1).mean(axis=0))
    np.testing.assert_allclose(offset, 0.05 * np.array(distance), rtol=0.1)
    turned = np.sqrt((rotation_error_rad(seen[..., 3:], task.goals[:, 3:]) ** 2).mean(axis=0))
    np.testing.assert_allclose(turned, 0.05 * np.pi / 2, rtol=0.1)
    six = observe(state, replace(task, goals=seen[0]))["relative_goal"][:, 3:].reshape(-1, 2, 3)
    np.testing.assert_allclose(six @ six.transpose(0, 2, 1), np.tile(np.eye(2), (SLOTS, 1, 1)), atol=1e-5)


def test_the_distillations_noise_is_on_each_coordinate_and_velocity_of_objects():
    state, task = make_inputs()
    noise, true = make_noise(DISTILLATION_NOISE), observe(state, task)
    assert noise.disturb_inputs(ALL, steps(0), state, task) == (state, task)
    seen = noise.disturb_points(ALL, steps(0), true)
    for name in ("object_points", "environment_points"):
        error = seen[name] - true[name]
        assert not error[..., 3].any(), "masses are right"
        for columns in (slice(0, 3), slice(4, 7)):
            assert error[..., columns].std() == pytest.approx(0.05, rel=0.02)
            assert error[..., columns].mean() == pytest.approx(0, abs=0.002)
    rest = [name for name in cast(dict, true) if name not in ("object_points", "environment_points")]
    assert all(cast(dict, seen)[name] is cast(dict, true)[name] for name in rest)
    again, later = (noise.disturb_points(ALL, steps(step), true) for step in (0, 1))
    assert np.array_equal(again["object_points"], seen["object_points"])
    assert not np.array_equal(later["object_points"], seen["object_points"])


def test_the_sensitivity_study_has_four_levels_of_four_sources():
    assert SENSITIVITY_LEVELS == (0.005, 0.05, 0.25, 0.5)
    assert sensitivity_noise("velocity", 0.5) == NoiseConfig(velocity=0.5)
    assert sensitivity_noise("all", 0.05) == NoiseConfig(mass=0.05, velocity=0.05, goal_pose=0.05)
    with pytest.raises(UnknownNameError, match="did you mean 'goal_pose'"):
        sensitivity_noise("goalpose", 0.05)


@pytest.mark.parametrize("name", [field.name for field in fields(NoiseConfig)])
@pytest.mark.parametrize("value", [-0.1, float("nan"), 50.0])
def test_what_is_no_share_is_refused(name, value):
    with pytest.raises(InvalidValueError, match=rf"noise {name} is .* as 0.05 for 5%"):
        NoiseConfig(**{name: value})


@pytest.mark.parametrize("config", [NoiseConfig(mass=0.1), NoiseConfig(velocity=0.1), NoiseConfig(goal_pose=0.1)])
def test_a_slot_without_an_episode_has_no_noise_to_be_seen_with(config):
    state, task = make_inputs(1)
    with pytest.raises(InvalidValueError, match="slot 0 .* no episode yet"):
        ObservationNoise(config, 1, OBJECTS).disturb_inputs(np.array([0]), steps(0, 1), state, task)
