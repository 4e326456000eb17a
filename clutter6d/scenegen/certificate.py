"""The evidence that a scene is valid, measured in the simulator (benchmark: "A valid scene carries a certificate")."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import mujoco
import numpy as np
from jaxtyping import Bool, Float64, Int

from clutter6d.geometry import quat_from_yaw, quat_multiply
from clutter6d.scene import TABLE, Certificate, SceneGraph
from clutter6d.scenegen.footprint import Layout, layout_of
from clutter6d.scenegen.relations import RelationRules, broken_relations
from clutter6d.sim.batch import SceneBatch
from clutter6d.sim.contacts import Contact, find_contacts, max_penetration_m, robot_touches
from clutter6d.sim.robot import HOME_QPOS, inverse_kinematics
from clutter6d.sim.robot_facts import TIP_OFFSET_M
from clutter6d.sim.scene_model import SceneModel, joint_state
from clutter6d.sim.settle import SettleConfig, hold, measure_drift, settle

GENERATOR_VERSION = "1"
"""Changes whenever a seed would give another scene."""

DOWN = np.array([0.0, 1.0, 0.0, 0.0])
"""Hand orientation with the fingers pointing at the table."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CertificateLimits:
    """What a valid scene must keep (benchmark page).

    Attributes:
        penetration_m: Deepest allowed contact.
        drift_m: Largest displacement in 1 s.
        drift_rad: Largest rotation in 1 s (1 degree).
        settling_m: How far the target may move from where it was placed until it rests.
        settling_rad: How far it may turn: more, and it rests on another face than the one it was placed on.
        hover_gaps_m: Clearances of the finger tips above the target's top, at one of which the hand must be able to
            hover; the higher one is for targets beside taller obstacles.
        hover_yaws: Directions of the hand tried at each hover pose.
    """

    penetration_m: float = 1e-3
    drift_m: float = 1e-3
    drift_rad: float = float(np.deg2rad(1.0))
    settling_m: float = 1e-3
    settling_rad: float = float(np.deg2rad(2.0))
    hover_gaps_m: tuple[float, ...] = (0.05, 0.20)
    hover_yaws: int = 4


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class StateReport:
    """What was measured of each of several states of one scene.

    Attributes:
        poses: Settled poses of all objects.
        penetration_m: Deepest contact of each.
        drift_m: Largest displacement of an object within 1 s.
        drift_rad: Largest rotation of an object within 1 s.
        failures: Why a state is not valid, or ``None``.
    """

    poses: Float64[np.ndarray, "state object 7"]
    penetration_m: Float64[np.ndarray, "state"]
    drift_m: Float64[np.ndarray, "state"]
    drift_rad: Float64[np.ndarray, "state"]
    failures: tuple[str | None, ...]

    def with_failures(self, reason: str, has_failed: Bool[np.ndarray, "state"]) -> "StateReport":
        """This report with a further reason for those states that had none yet."""
        both = zip(self.failures, has_failed, strict=True)
        return replace(self, failures=tuple(reason if old is None and failed else old for old, failed in both))


def settle_and_check(
    scene: SceneModel,
    hulls: tuple[np.ndarray, ...],
    poses: Float64[np.ndarray, "state object 7"],
    graph: SceneGraph,
    *,
    rules: RelationRules,
    limits: CertificateLimits,
    config: SettleConfig,
    threads: int = 1,
) -> StateReport:
    """Let several states of one scene come to rest, and examine each at rest and for 1 s more.

    Args:
        scene: The compiled scene.
        hulls: Hull points of its objects.
        poses: States as placed.
        graph: Relations that must hold at rest.
        rules: Thresholds of the relations.
        limits: What is valid.
        config: When objects count as at rest.
        threads: Threads of the simulation.
    """
    batch = SceneBatch([scene] * len(poses), threads=threads)
    batch.reset(np.arange(len(poses)), poses)
    settled = settle(batch, config)
    resting = batch.object_poses.copy()
    settling = measure_drift(poses[:, :1], resting[:, :1])
    settled &= ((settling.distance_m <= limits.settling_m) & (settling.angle_rad <= limits.settling_rad))[:, 0]
    report = _examine(batch, scene, hulls, resting, graph, rules, limits, config)
    return report.with_failures("drifted", ~settled)


def check_at_rest(
    scene: SceneModel,
    hulls: tuple[np.ndarray, ...],
    poses: Float64[np.ndarray, "state object 7"],
    graph: SceneGraph,
    *,
    rules: RelationRules,
    limits: CertificateLimits,
    config: SettleConfig,
    threads: int = 1,
) -> StateReport:
    """Examine several states of one scene as they are, and for 1 s more; arguments as :func:`settle_and_check`."""
    batch = SceneBatch([scene] * len(poses), threads=threads)
    return _examine(batch, scene, hulls, poses, graph, rules, limits, config)


def _examine(
    batch: SceneBatch,
    scene: SceneModel,
    hulls: tuple[np.ndarray, ...],
    poses: Float64[np.ndarray, "state object 7"],
    graph: SceneGraph,
    rules: RelationRules,
    limits: CertificateLimits,
    config: SettleConfig,
) -> StateReport:
    drift = hold(batch, poses, config)
    drift_m, drift_rad = drift.distance_m.max(axis=1), drift.angle_rad.max(axis=1)
    failures: list[str | None] = []
    penetration = np.zeros(len(poses))
    for row, state in enumerate(poses):
        contacts = find_contacts(scene, joint_state(state))
        penetration[row] = max_penetration_m(contacts)
        still = bool((drift_m[row] <= limits.drift_m) & (drift_rad[row] <= limits.drift_rad))
        shallow = bool(penetration[row] <= limits.penetration_m)
        layout = layout_of(scene.names, hulls, state)
        failures.append(
            _state_failure(scene, state, layout, contacts, graph, rules, is_still=still, is_shallow=shallow)
        )
    return StateReport(
        poses=poses, penetration_m=penetration, drift_m=drift_m, drift_rad=drift_rad, failures=tuple(failures)
    )


def _state_failure(
    scene: SceneModel,
    state: Float64[np.ndarray, "object 7"],
    layout: Layout,
    contacts: tuple[Contact, ...],
    graph: SceneGraph,
    rules: RelationRules,
    *,
    is_still: bool,
    is_shallow: bool,
) -> str | None:
    if (state[:, 2] < 0).any() or not np.isfinite(state).all():
        return "fell"
    if not is_still:
        return "drifted"
    if not is_shallow or robot_touches(scene, contacts):
        return "overlap"
    if broken_relations(graph, layout, find_supporters(scene.names, contacts), rules):
        return "relation broken"
    return None


def find_supporters(names: Sequence[str], contacts: tuple[Contact, ...]) -> dict[str, frozenset[str]]:
    """What each object touches: names of objects, and the table."""
    touching: dict[str, set[str]] = {name: set() for name in names}
    for contact in contacts:
        for name in contact.bodies & touching.keys():
            touching[name] |= {TABLE if other == "world" else other for other in contact.bodies - {name}}
    return {name: frozenset(others) for name, others in touching.items()}


def is_reachable(
    scene: SceneModel,
    states: Float64[np.ndarray, "state object 7"],
    tops_m: Float64[np.ndarray, "state"],
    limits: CertificateLimits,
) -> Bool[np.ndarray, "state"]:
    """Whether the hand can hover over the target (object 0) of each state, pointing down, touching nothing.

    Args:
        scene: The compiled scene.
        states: Poses of all objects.
        tops_m: Height of the target's highest point in each state.
        limits: Clearance and hand directions tried.
    """
    reachable = np.zeros(len(states), dtype=bool)
    data = mujoco.MjData(scene.model)
    for gap, turn in product(limits.hover_gaps_m, range(limits.hover_yaws)):
        rows = np.flatnonzero(~reachable)
        if not len(rows):
            break
        targets = _hover_poses(states[rows], tops_m[rows] + gap, turn * np.pi / limits.hover_yaws)
        qpos, converged = inverse_kinematics(targets, HOME_QPOS, restarts=1)
        for row, arm, good in zip(rows, qpos, converged, strict=True):
            if good:
                contacts = find_contacts(scene, joint_state(states[row], arm), data)
                reachable[row] = not robot_touches(scene, contacts)
    return reachable


def _hover_poses(
    states: Float64[np.ndarray, "n object 7"], tip_heights_m: Float64[np.ndarray, "n"], yaw: float
) -> Float64[np.ndarray, "n 7"]:
    """Hand poses with the finger tips straight above the target's origin, pointing down."""
    positions = np.concatenate([states[:, 0, :2], tip_heights_m[:, None] + TIP_OFFSET_M], axis=1)
    quat = quat_multiply(quat_from_yaw(yaw), DOWN)
    return np.concatenate([positions, np.broadcast_to(quat, (len(states), 4))], axis=1)


def make_certificate(measured: Sequence[tuple[StateReport, Int[np.ndarray, "_"]]], relation_count: int) -> Certificate:
    """The worst case over the chosen rows of several reports."""
    chosen = [(report, rows) for report, rows in measured if len(rows)]
    return Certificate(
        max_penetration_m=max(float(report.penetration_m[rows].max()) for report, rows in chosen),
        max_drift_m=max(float(report.drift_m[rows].max()) for report, rows in chosen),
        max_drift_rad=max(float(report.drift_rad[rows].max()) for report, rows in chosen),
        relations_hold=relation_count,
        reachable_poses=sum(len(rows) for _, rows in chosen),
        engine_version=mujoco.__version__,
        generator_version=GENERATOR_VERSION,
    )
