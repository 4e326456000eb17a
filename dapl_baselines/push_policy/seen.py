"""What a policy that pushes knows, from the true state or from points alone; both in the same terms."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from jaxtyping import Float, Float64, Int

from clutter6d.envs.observation import BodyState, Observation
from clutter6d.geometry import quat_from_matrix
from clutter6d.sim.kinematics import HandKinematics, hand_kinematics
from dapl_baselines.push_policy.push_state import PushState, SceneFacts, hand_parts, read_push_state
from dapl_baselines.push_policy.target_shapes import CONTACTS, TargetShapes, outermost

NEIGHBOURS: Final = 12
"""Points that a surface normal is fitted to."""
BESIDE_M: Final = 0.015
ON_SURFACE_M: Final = 0.001
FADING_M: Final = 0.02
"""Points that tell which side of a surface is inside: no further than the first from the normal's line, off the surface
by more than the second; the third is the distance at which they count e times less."""
EVERY_OBSTACLE_POINT: Final = 4
"""One of so many observed points of other objects is looked at to fly over them."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Seen:
    """Some slots, one row each.

    Attributes:
        state: Where things are.
        goals: Where the targets shall go.
        shapes: Shapes of targets.
        targets: Which of them each row's target has.
        obstacle_points: Points of other objects, world frame [m].
        hand: Kinematics of the hands.
        qpos: Joint angles [rad].
        qvel: Joint velocities [rad/s].
    """

    state: PushState[np.ndarray]
    goals: Float64[np.ndarray, "row 7"]
    shapes: TargetShapes
    targets: Int[np.ndarray, "row"]
    obstacle_points: Float64[np.ndarray, "row point 3"]
    hand: HandKinematics[np.ndarray]
    qpos: Float64[np.ndarray, "row 7"]
    qvel: Float64[np.ndarray, "row 7"]

    def rows(self, slots: Int[np.ndarray, "chosen"]) -> "Seen":
        """Some of them."""
        return replace(
            self,
            state=self.state.rows(slots),
            goals=self.goals[slots],
            targets=self.targets[slots],
            obstacle_points=self.obstacle_points[slots],
            hand=self.hand[slots],
            qpos=self.qpos[slots],
            qvel=self.qvel[slots],
        )

    def points_in_the_way(self) -> Float64[np.ndarray, "row point 3"]:
        """What the hand must fly over: the targets' contact points and points of other objects, world frame [m]."""
        return np.concatenate(
            [self.shapes.placed_contacts(self.targets, self.state.poses), self.obstacle_points], axis=1
        )


def see_states(
    bodies: BodyState[np.ndarray],
    goals: Float64[np.ndarray, "row 7"],
    facts: SceneFacts,
    shapes: TargetShapes,
    targets: Int[np.ndarray, "row"],
) -> Seen:
    """Privileged: as the simulation knows it.

    Args:
        bodies: Where everything is and how it moves.
        goals: Where the targets shall go.
        facts: Of the same slots.
        shapes: Shapes of targets.
        targets: Which of them each row's target has.
    """
    hand = hand_kinematics(bodies.arm_qpos)
    state = read_push_state(bodies, hand, facts)
    return Seen(
        state=state,
        goals=goals,
        shapes=shapes,
        targets=targets,
        obstacle_points=facts.placed_surfaces(bodies.object_poses),
        hand=hand,
        qpos=bodies.arm_qpos,
        qvel=bodies.arm_qvel,
    )


def see_points(observation: Observation[np.ndarray], *, has_normals: bool = True) -> Seen:
    """From points alone, with what a robot knows of itself.

    The target's frame is that of the world, at the centroid of its points, which stands in for the centre of mass that
    its goal is told by. Velocities are those of the rigid body that its points' velocities fit best, the mass is theirs
    together. Friction and other objects are not known; of the others, tokens tell.

    Args:
        observation: What is observed.
        has_normals: Whether surface normals are wanted, which drawing pushes needs and carrying them out does not; zero
            without.
    """
    points = observation["object_points"].astype(np.float64)
    joints, goal = observation["joint_state"].astype(np.float64), observation["relative_goal"].astype(np.float64)
    centroid, rows = points[..., :3].mean(axis=1), len(points)
    offsets = points[..., :3] - centroid[:, None]
    hand = hand_kinematics(joints[:, :7])
    nowhere = np.tile([1.0, 0, 0, 0], (rows, 1))
    tips, tip_velocities, hands = hand_parts(hand, joints[:, 7:])
    state = PushState(
        poses=np.concatenate([centroid, nowhere], axis=1),
        velocities=fit_velocities(offsets, points[..., 4:]),
        obstacles=np.zeros((rows, 0, 5)),
        physics=np.stack([points[..., 3].sum(axis=1), np.zeros(rows)], axis=1),
        tips=tips,
        tip_velocities=tip_velocities,
        hands=hands,
    )
    goals = np.concatenate([centroid + goal[:, :3], quat_from_matrix(_rotation(goal[:, 3:]))], axis=1)
    contacts = offsets[:, :: offsets.shape[1] // CONTACTS]
    shapes = TargetShapes(
        index={},
        contacts=contacts,
        normals=fit_normals(contacts, offsets) if has_normals else np.zeros_like(contacts),
        surface=outermost(offsets),
    )
    return Seen(
        state=state,
        goals=goals,
        shapes=shapes,
        targets=np.arange(rows),
        obstacle_points=observation["environment_points"][:, ::EVERY_OBSTACLE_POINT, :3].astype(np.float64),
        hand=hand,
        qpos=joints[:, :7],
        qvel=joints[:, 7:],
    )


def fit_velocities(
    offsets: Float64[np.ndarray, "row point 3"], velocities: Float64[np.ndarray, "row point 3"]
) -> Float64[np.ndarray, "row 6"]:
    """Linear and angular velocity of the rigid body that moves most like points, by least squares.

    Args:
        offsets: Where the points are, from their centroid [m].
        velocities: How they move [m/s].
    """
    linear = velocities.mean(axis=1)
    momentum = np.cross(offsets, velocities - linear[:, None]).mean(axis=1)
    spread = np.einsum("rpi,rpj->rij", offsets, offsets) / offsets.shape[1]
    inertia = np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3) - spread
    angular = np.linalg.solve(inertia + 1e-9 * np.eye(3), momentum[..., None])[..., 0]
    return np.concatenate([linear, angular], axis=1)


def fit_normals(
    at: Float64[np.ndarray, "row contact 3"], points: Float64[np.ndarray, "row point 3"]
) -> Float64[np.ndarray, "row contact 3"]:
    """Unit normals of a surface of which points are known, towards the side on which fewer of them are near.

    Args:
        at: Where [m].
        points: The points [m].
    """
    distances = ((at[:, :, None] - points[:, None]) ** 2).sum(axis=-1)
    nearest = np.argpartition(distances, NEIGHBOURS, axis=-1)[..., :NEIGHBOURS]
    around = points[np.arange(len(points))[:, None, None], nearest]
    around = around - around.mean(axis=2, keepdims=True)
    _, axes = np.linalg.eigh(np.einsum("rcni,rcnj->rcij", around, around))
    normals = axes[..., 0]
    ahead = np.einsum("rpi,rci->rcp", points, normals) - (at * normals).sum(axis=-1, keepdims=True)
    is_close = (distances - ahead**2 < BESIDE_M**2) & (np.abs(ahead) > ON_SURFACE_M)
    occupied = (is_close * np.sign(ahead) * np.exp(-np.abs(ahead) / FADING_M)).sum(axis=-1, keepdims=True)
    return normals * np.where(occupied > 0, -1.0, 1.0)


def _rotation(six: Float[np.ndarray, "row 6"]) -> Float64[np.ndarray, "row 3 3"]:
    """The rotation matrix of its first two columns."""
    first, second = six[:, :3], six[:, 3:]
    return np.stack([first, second, np.cross(first, second)], axis=-1)
