"""Scripted pushes: the hand comes down beside the target, sweeps through it, and stops; the obstacles are not avoided.

The joint targets are the same whatever physics they are played in, so that outcomes can be compared.
"""

from itertools import pairwise

import numpy as np
from frozen_tasks import Tasks

from clutter6d.seeding import generator
from clutter6d.sim.robot import HOME_QPOS, inverse_kinematics
from clutter6d.sim.robot_facts import TIP_OFFSET_M

CLEARANCE_M = 0.01
ABOVE_M = 0.25
BEFORE_M, BEYOND_M = 0.14, 0.10
LEG_STEPS = (8, 6, 12, 4)
"""Control steps to above the start, down to it, across, and of holding still."""
PUSH_STEPS = sum(LEG_STEPS)
TRIES = 12


def push_targets(tasks: Tasks, *, seed: int = 0) -> np.ndarray:
    """Joint targets ``[step, task, 7]`` [rad] of one push of each task's target, in a random direction.

    Directions that the arm does not reach from its home posture without turning over are drawn again; a task for which
    none is found keeps the arm at home.
    """
    rng = generator(seed, "pushes")
    waypoints = np.tile(HOME_QPOS, (3, len(tasks), 1))
    open_rows = np.arange(len(tasks))
    for _ in range(TRIES):
        turns = rng.uniform(-np.pi, np.pi, size=len(tasks))[open_rows]
        hand_poses = _hand_poses(tasks.object_poses[open_rows, 0], turns)
        solved = [inverse_kinematics(rows, HOME_QPOS, restarts=0) for rows in hand_poses]
        good = np.all([converged for _, converged in solved], axis=0)
        for waypoint, (qpos, _) in zip(waypoints, solved, strict=True):
            waypoint[open_rows[good]] = qpos[good]
        open_rows = open_rows[~good]
        if not len(open_rows):
            break
    return _interpolate(waypoints)


def _hand_poses(target_poses: np.ndarray, turns: np.ndarray) -> list[np.ndarray]:
    """Hand above the start of the push, at its start and at its end, pointing down and across the push."""
    direction = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    yaw = (turns + np.pi / 2) % np.pi - np.pi / 2  # the hand is symmetric: turn it by at most a quarter
    quat = np.stack([np.zeros_like(yaw), np.cos(yaw / 2), np.sin(yaw / 2), np.zeros_like(yaw)], axis=1)
    rows: list[np.ndarray] = []
    for along, height in ((-BEFORE_M, ABOVE_M), (-BEFORE_M, 0.0), (BEYOND_M, 0.0)):
        planar = target_poses[:, :2] + along * direction
        z = np.full((len(turns), 1), TIP_OFFSET_M + CLEARANCE_M + height)
        rows.append(np.concatenate([planar, z, quat], axis=1))
    return rows


def _interpolate(waypoints: np.ndarray) -> np.ndarray:
    """Straight lines in joint space through home and the waypoints, then still."""
    corners = [np.broadcast_to(HOME_QPOS, waypoints[0].shape), *waypoints, waypoints[-1]]
    legs = zip(pairwise(corners), LEG_STEPS, strict=True)
    shares = [(a + (b - a) * (k / steps)) for (a, b), steps in legs for k in range(1, steps + 1)]
    return np.stack(shares)
