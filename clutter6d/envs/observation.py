"""What a policy sees (paper, Table "Summary of our MDP components")."""

from typing import TypedDict

import numpy as np
from jaxtyping import Float32


class Observation(TypedDict):
    """One row a slot, float32; metres, kilograms, seconds, radians; world frame.

    A point's features are ``x y z``, its share of the object's mass (mass over number of points), and its velocity as
    a point of the rigid body. Rotations are in 6-D: the first two columns of the matrix.

    Attributes:
        object_points: Canonical surface points of the target.
        environment_points: Of all obstacles' points, the 512 nearest to the target's centroid, in the obstacles' order.
        end_effector_points: Canonical surface points of the hand and the fingers.
        hand_state: Position and rotation of the hand's frame.
        joint_state: Joint angles, then joint velocities.
        relative_goal: Goal pose in the target's frame: translation and rotation.
        physics_parameters: Privileged: target's mass, target's, hand's and table's friction, target's restitution.
        previous_action: The residual the policy asked for one step ago; zero at first.
    """

    object_points: Float32[np.ndarray, "slot 512 7"]
    environment_points: Float32[np.ndarray, "slot 512 7"]
    end_effector_points: Float32[np.ndarray, "slot 256 7"]
    hand_state: Float32[np.ndarray, "slot 9"]
    joint_state: Float32[np.ndarray, "slot 14"]
    relative_goal: Float32[np.ndarray, "slot 9"]
    physics_parameters: Float32[np.ndarray, "slot 5"]
    previous_action: Float32[np.ndarray, "slot 7"]
