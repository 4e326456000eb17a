"""The reward against the paper's equations written out for one slot, in plain Python.

Paper, "Reward Function" and "Obstacle Motion Penalty"; quaternions are ``wxyz``.
"""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.envs.reward import RewardConfig, compute_reward, disturbance_factor
from clutter6d.seeding import generator

CONFIG = RewardConfig()
Vector = list[float]
Pose = list[float]


def distance(a: Vector, b: Vector) -> float:
    total = 0.0
    for i in range(len(a)):
        total += (a[i] - b[i]) ** 2
    return math.sqrt(total)


def angle(a: Pose, b: Pose) -> float:
    dot = 0.0
    for i in range(3, 7):
        dot += a[i] * b[i]
    return 2 * math.acos(min(abs(dot), 1.0))


def success_factor(obstacles: list[Pose], starts: list[Pose]) -> float:
    if not obstacles:
        return 1.0
    shift, turn = 0.0, 0.0
    for now, start in zip(obstacles, starts, strict=True):
        shift += distance(now[:3], start[:3]) / len(obstacles)
        turn += angle(now, start) / len(obstacles)
    motion = (min(max(shift / 0.10, 0), 1) + min(max(turn / (math.pi / 4), 0), 1)) / 2
    return min(max(1 - 0.5 * motion, 0.5), 1.0)


def terms_by_the_paper(poses: list[Pose], starts: list[Pose], goal: Pose, fingers: list[Vector]) -> dict[str, float]:
    target = poses[0]
    reach = min(distance(finger, target[:3]) for finger in fingers)
    error = distance(target[:3], goal[:3]) + angle(target, goal) / 5
    gate = 1.0 if reach < 0.1 else 0.0
    success = distance(target[:2], goal[:2]) < 0.05 and angle(target, goal) < 0.1
    return {
        "proximity": 1 - math.tanh(reach / 0.1),
        "coarse": 5 * gate * (1 - math.tanh(error / 0.6)),
        "fine": 16 * gate * (1 - math.tanh(error / 0.3)),
        "success": 2000 * success_factor(poses[1:], starts[1:]) if success else 0.0,
    }


def near(rng: np.random.Generator, poses: np.ndarray, metres: float, radians: float) -> np.ndarray:
    """Poses moved by up to so much."""
    moved = poses.copy()
    moved[..., :3] += rng.uniform(-metres, metres, size=moved[..., :3].shape)
    moved[..., 3:] += rng.uniform(-radians, radians, size=moved[..., 3:].shape) / 2
    moved[..., 3:] /= np.linalg.norm(moved[..., 3:], axis=-1, keepdims=True)
    return moved


def random_states(seed: int, slots: int, obstacles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Poses, start poses, goals and fingers: goals reached and not, fingers near and far, obstacles moved or not."""
    rng = generator(seed, "states")
    starts = near(rng, np.tile([0.0, 0, 0, 1, 0, 0, 0], (slots, 1 + obstacles, 1)), 0.4, 2.0)
    poses = near(rng, starts, 0.0, 0.0)
    goals = near(rng, starts[:, 0], 0.3, 2.0)
    for slot in range(slots):
        poses[slot] = near(rng, starts[slot], rng.choice([0.0, 0.02, 0.3]), rng.choice([0.0, 0.1, 2.0]))
        if rng.uniform() < 0.6:
            goals[slot] = near(rng, poses[slot, 0], rng.choice([0.0, 0.03, 0.06]), rng.choice([0.0, 0.05, 0.2]))
    fingers = poses[:, :1, :3] + rng.uniform(-0.12, 0.12, size=(slots, 2, 3))
    return poses, starts, goals, fingers


@given(seed=st.integers(0, 10_000), obstacles=st.integers(0, 11))
def test_every_term_is_the_papers(seed, obstacles):
    states = random_states(seed, 12, obstacles)
    terms = compute_reward(*states, CONFIG)
    for slot in range(12):
        expected = terms_by_the_paper(*(values[slot].tolist() for values in states))
        for name, value in expected.items():
            assert abs(float(getattr(terms, name)[slot]) - value) < 1e-9, name
        assert abs(float(terms.total[slot]) - sum(expected.values())) < 1e-9


def test_the_random_states_reach_every_case():
    """Otherwise the comparison above would show little."""
    terms = compute_reward(*random_states(0, 500, 3), CONFIG)
    assert 0.05 < (terms.success > 0).mean() < 0.8
    assert ((terms.success > 1000) & (terms.success < 2000)).mean() > 0.01
    assert 0.1 < (terms.coarse > 0).mean() < 0.95


@given(seed=st.integers(0, 10_000))
def test_the_factor_is_the_papers_at_any_motion(seed):
    poses, starts, _, _ = random_states(seed, 8, 5)
    factors = disturbance_factor(poses, starts, CONFIG)
    for slot in range(8):
        assert abs(factors[slot] - success_factor(poses[slot].tolist(), starts[slot].tolist())) < 1e-9


@given(seed=st.integers(0, 10_000))
def test_quaternions_whose_product_rounds_beyond_one_give_no_nan(seed):
    poses, _, _, fingers = random_states(seed, 50, 3)
    poses[..., 3:] *= 1 + 4e-16 * generator(seed, "rounding").integers(0, 3, size=(50, 4, 1))
    assert np.isfinite(compute_reward(poses, poses, poses[:, 0], fingers, CONFIG).total).all()
