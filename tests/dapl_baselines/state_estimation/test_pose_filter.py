import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clutter6d.errors import InvalidValueError
from clutter6d.geometry import is_unit, quat_from_yaw, quat_multiply, rotate, rotation_error_rad
from clutter6d.seeding import generator
from dapl_baselines.state_estimation.motion_belief import MotionBelief, predict
from dapl_baselines.state_estimation.pose_filter import PoseFilter, PoseFilterConfig
from tests.dapl_baselines.state_estimation.tracks import Track, differences, integrate, rms, see

BODIES = 48
NOISE = (0.002, 0.02)


def constant_twist(_time):
    rng = generator(1, "twist")
    return np.concatenate([rng.normal(scale=0.1, size=(BODIES, 3)), rng.normal(scale=0.6, size=(BODIES, 3))], axis=1)


def accelerated(time):
    return constant_twist(0) * (0.2 + 0.4 * time)


def pushed_from_rest(time):
    """Rest, a push that takes 0.1 s to reach full speed, 1 s of sliding, rest."""
    ramp = np.clip((time - 1.0) / 0.1, 0, 1) * np.clip((2.1 - time) / 0.1, 0, 1)
    return constant_twist(0) * ramp


def at_rest_always(_time):
    return np.zeros((BODIES, 6))


def filtered(track: Track, seen: np.ndarray, config: PoseFilterConfig | None = None, is_measured=None) -> np.ndarray:
    tracker = PoseFilter(seen.shape[1:-1], config)
    shown = np.ones(seen.shape[:-1], dtype=bool) if is_measured is None else is_measured
    return np.stack([tracker.update(*row, track.dt_s, is_measured=now) for *row, now in zip(seen, shown, strict=True)])


# How many times less the filter's error is than that of differences: linear, angular; after the first second.
@pytest.mark.parametrize(
    ("motion", "rate_hz", "linear", "angular"),
    [
        (constant_twist, 10, 2.8, 2.8),
        (constant_twist, 25, 6.5, 6.5),
        (accelerated, 10, 2.4, 2.6),
        (accelerated, 25, 6.5, 6.5),
        (pushed_from_rest, 10, 1.1, 1.3),
        (pushed_from_rest, 25, 2.7, 3.3),
        (at_rest_always, 10, 2.8, 2.8),
        (at_rest_always, 25, 6.5, 6.5),
    ],
)
def test_velocities_are_nearer_the_truth_than_differences_of_poses(motion, rate_hz, linear, angular):
    track = integrate(motion, 3.0, 1 / rate_hz, BODIES)
    seen = see(track.poses, *NOISE)
    ours = rms((filtered(track, seen) - track.velocities)[rate_hz:])
    theirs = rms((differences(seen, track.dt_s) - track.velocities)[rate_hz:])
    assert theirs[0] / ours[0] > linear
    assert theirs[1] / ours[1] > angular


def test_without_noise_a_constant_twist_is_found_to_the_last_bits():
    track = integrate(constant_twist, 4.0, 0.1, BODIES)
    np.testing.assert_allclose(filtered(track, track.poses)[-1], track.velocities[-1], atol=2e-3)


def random_walk(config: PoseFilterConfig, steps: int, dt_s: float, seed: int) -> Track:
    """A track of the very model that the filter assumes."""
    rng, variance = generator(seed, "walk"), np.repeat([config.linear_walk, config.angular_walk], 3) ** 2
    first = np.repeat([config.first_linear_sigma, config.first_angular_sigma], 3)
    pose = np.tile([0.0, 0, 0, 1, 0, 0, 0], (BODIES, 1))
    velocity, parts, no_covariance = first * rng.standard_normal((BODIES, 6)), 10, np.zeros((BODIES, 12, 12))
    poses, velocities = [pose], [velocity]
    for _ in range(steps):
        for _ in range(parts):
            now = MotionBelief(poses=pose, velocities=velocity, covariance=no_covariance)
            pose = predict(now, dt_s / parts).poses
            velocity = velocity + np.sqrt(variance * dt_s / parts) * rng.standard_normal((BODIES, 6))
        poses.append(pose)
        velocities.append(velocity)
    return Track(poses=np.stack(poses), velocities=np.stack(velocities), dt_s=dt_s)


def test_the_filter_is_as_sure_as_it_may_be():
    """Innovations and velocity errors, weighed with what was expected of them, are chi-square distributed."""
    config = PoseFilterConfig()
    track = random_walk(config, 40, 0.1, seed=3)
    seen, tracker, surprises, errors = see(track.poses, *NOISE), PoseFilter((BODIES,), config), [], []
    for poses, truth in zip(seen, track.velocities, strict=True):
        error = tracker.update(poses, track.dt_s) - truth
        covariance = tracker.belief.covariance[:, 6:, 6:]
        errors.append((error * np.linalg.solve(covariance, error[..., None])[..., 0]).sum(axis=1))
        surprises.append(tracker.surprise)
    surprise, error = np.stack(surprises)[5:], np.stack(errors)[5:]
    # The mean of n chi-squares of 6 degrees has a standard deviation of sqrt(12 / n).
    tolerance = 4 * np.sqrt(12 / surprise.size)
    assert abs(surprise.mean() - 6) < tolerance
    assert abs(np.median(surprise) - 5.35) < 0.35
    # Errors of successive steps are alike: about a sixth as many of them are independent.
    assert abs(error.mean() - 6) < 4 * np.sqrt(12 / (error.size / 6))


@pytest.mark.parametrize("motion", [constant_twist, at_rest_always])
def test_dropped_frames_cost_little(motion):
    track = integrate(motion, 4.0, 0.1, BODIES)
    seen, shown = see(track.poses, *NOISE), generator(0, "drops").random(track.poses.shape[:2]) > 0.2
    whole = rms((filtered(track, seen) - track.velocities)[10:])
    holed = np.where(shown[..., None], seen, np.nan)
    dropped = rms((filtered(track, holed) - track.velocities)[10:])
    told = rms((filtered(track, seen, is_measured=shown) - track.velocities)[10:])
    assert dropped == told
    assert dropped[0] < 1.6 * whole[0]
    assert dropped[1] < 1.6 * whole[1]


def test_a_body_that_is_out_of_sight_for_long_counts_as_resting_and_starts_anew():
    track = integrate(constant_twist, 2.0, 0.1, BODIES)
    tracker, dark = PoseFilter((BODIES,)), np.full((BODIES, 7), np.nan)
    for poses in track.poses:
        tracker.update(poses, 0.1)
    for _ in range(tracker.config.max_coasted):
        assert np.abs(tracker.update(dark, 0.1)).max() > 0.1
    assert not tracker.update(dark, 0.1).any()
    assert not tracker.is_tracked.any()
    assert not tracker.update(track.poses[0], 0.1).any()
    assert tracker.is_tracked.all()
    np.testing.assert_allclose(tracker.belief.poses, track.poses[0], atol=1e-12)


def test_a_flip_is_skipped_and_a_lasting_jump_is_followed():
    rest = np.tile([0.1, 0.2, 0.05, 1, 0, 0, 0], (2, 1))
    flipped = rest.copy()
    flipped[0, 3:] = quat_from_yaw(np.pi / 2)
    moved = rest.copy()
    moved[1, :3] += 0.4
    tracker = PoseFilter((2,))
    for poses in (rest, rest, flipped, rest):
        velocities = tracker.update(poses, 0.1)
        assert not velocities.any()
        assert np.array_equal(tracker.belief.poses, rest)
    for _ in range(tracker.config.max_coasted + 2):
        assert not tracker.update(moved, 0.1).any()
    np.testing.assert_allclose(tracker.belief.poses, moved)


def test_time_between_updates_may_vary():
    track = integrate(constant_twist, 4.0, 0.01, BODIES)
    steps = np.cumsum(generator(0, "times").choice([3, 5, 10, 12], size=40))
    seen, tracker = see(track.poses, *NOISE), PoseFilter((BODIES,))
    for before, now in zip([steps[0] - 5, *steps[:-1]], steps, strict=True):
        velocities = tracker.update(seen[now], float(now - before) * 0.01)
    error = rms(velocities - track.velocities[now])
    assert error[0] < 0.03
    assert error[1] < 0.3


def test_a_body_does_not_depend_on_the_others():
    track = integrate(constant_twist, 1.0, 0.1, BODIES)
    seen = see(track.poses, *NOISE)
    whole = filtered(track, seen)
    np.testing.assert_allclose(filtered(track, seen[:, 7:8]), whole[:, 7:8], rtol=0, atol=1e-12)
    stacked = PoseFilter((2, BODIES // 2))
    for poses in seen:
        last = stacked.update(poses.reshape(2, -1, 7), 0.1)
    np.testing.assert_allclose(last.reshape(-1, 6), whole[-1], rtol=0, atol=1e-12)


@settings(max_examples=6)
@given(st.integers(0, 10_000))
def test_a_turned_and_shifted_world_turns_velocities_with_it(seed):
    """Linear velocities turn with the world; angular ones, in the body frame, stay as they are."""
    track = integrate(lambda time: constant_twist(time)[:3], 0.5, 0.1, 3, seed=seed)
    seen, turn = see(track.poses, *NOISE, seed=seed), quat_from_yaw(generator(seed, "turn").uniform(-3, 3))
    turned = np.concatenate(
        [rotate(turn, seen[..., :3]) + [0.3, -1.0, 0.2], quat_multiply(turn, seen[..., 3:])], axis=-1
    )
    ours, theirs = filtered(track, seen), filtered(track, turned)
    np.testing.assert_allclose(theirs[..., :3], rotate(turn, ours[..., :3]), atol=1e-9)
    np.testing.assert_allclose(theirs[..., 3:], ours[..., 3:], atol=1e-9)


@settings(max_examples=15)
@given(st.integers(0, 10_000), st.floats(0.005, 0.5))
def test_whatever_comes_the_belief_stays_a_belief(seed, dt_s):
    rng, tracker = generator(seed, "anything"), PoseFilter((4,))
    for _ in range(12):
        poses = rng.normal(size=(4, 7)) * rng.choice([1e-3, 1.0, 1e3])
        poses[rng.random(4) < 0.3] = np.nan
        velocities = tracker.update(poses, dt_s)
        assert np.isfinite(velocities).all()
        assert is_unit(tracker.belief.poses[:, 3:]).all()
        covariance = tracker.belief.covariance
        np.testing.assert_allclose(covariance, np.swapaxes(covariance, 1, 2), rtol=1e-6, atol=1e-12)
        assert (np.linalg.eigvalsh(covariance) > 0).all()


def test_poses_are_smoothed_too():
    track = integrate(at_rest_always, 4.0, 0.1, BODIES)
    tracker, seen = PoseFilter((BODIES,)), see(track.poses, *NOISE)
    for poses in seen:
        tracker.update(poses, 0.1)
    believed, truth = tracker.belief.poses, track.poses[-1]
    assert np.linalg.norm(believed[:, :3] - truth[:, :3], axis=1).mean() < 0.0027
    assert rotation_error_rad(believed[:, 3:], truth[:, 3:]).mean() < 0.027


def test_bodies_can_be_forgotten_one_by_one():
    track = integrate(constant_twist, 1.0, 0.1, BODIES)
    tracker, chosen = PoseFilter((BODIES,)), np.arange(BODIES) < 3
    for poses in track.poses:
        tracker.update(poses, 0.1)
    tracker.forget(chosen)
    velocities = tracker.update(track.poses[0], 0.1)
    assert not velocities[chosen].any()
    assert velocities[~chosen].any(axis=1).all()


@pytest.mark.parametrize("dt_s", [0.0, -0.1, np.nan, np.inf])
def test_time_must_go_on(dt_s):
    with pytest.raises(InvalidValueError, match="must be positive"):
        PoseFilter((1,)).update(np.array([[0.0, 0, 0, 1, 0, 0, 0]]), dt_s)


def test_other_bodies_than_before_are_refused():
    with pytest.raises(InvalidValueError, match="expected"):
        PoseFilter((2,)).update(np.zeros((3, 7)), 0.1)


@pytest.mark.parametrize(
    "wrong", [{"position_sigma_m": 0.0}, {"linear_walk": -1.0}, {"max_coasted": -1}, {"angular_walk": np.nan}]
)
def test_settings_that_mean_nothing_are_refused(wrong):
    with pytest.raises(InvalidValueError, match=next(iter(wrong))):
        PoseFilterConfig(**wrong)
