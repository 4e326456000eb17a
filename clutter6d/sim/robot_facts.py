"""Published facts about the Franka Research 3 (FR3) and the Franka hand.

Sources, by constant:

- ``JOINT_OFFSETS_M``, ``JOINT_TWISTS``, ``FLANGE_OFFSET_M``, ``HAND_YAW_RAD``: franka_description, kinematics (the FR3
  has the Denavit-Hartenberg parameters of the FER).
- ``JOINT_LOWER_RAD``, ``JOINT_UPPER_RAD``, ``JOINT_VELOCITY_RAD_S``, ``JOINT_TORQUE_NM``: franka_description,
  ``robots/fr3/joint_limits.yaml``, and the limits for the FR3 in the Franka Control Interface documentation.
- ``LINKS``: franka_description, ``robots/fr3/inertials.yaml``.
- ``HAND``, ``FINGER``: franka_description, ``end_effectors/franka_hand/inertials.yaml``.
- ``JOINT_ARMATURE_KG_M2``, ``JOINT_DAMPING_NM_S``: identified in torque control on a real FR3, as MuJoCo Menagerie's
  ``franka_fr3`` publishes them since 2025-04-25.

franka_description 1.1.0 widened the position limits by 0.05 to 0.1 rad; the tighter, longer-published ones are kept, so
that every recorded motion is allowed on every FR3. Metres, kilograms, radians, seconds.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

JOINT_NAMES = tuple(f"fr3_joint{i}" for i in range(1, 8))
BASE_POSITION_M = (-0.60, 0.0, 0.0)

JOINT_OFFSETS_M = (
    (0.0, 0.0, 0.333),
    (0.0, 0.0, 0.0),
    (0.0, -0.316, 0.0),
    (0.0825, 0.0, 0.0),
    (-0.0825, 0.384, 0.0),
    (0.0, 0.0, 0.0),
    (0.088, 0.0, 0.0),
)
"""Origin of each joint's frame in the frame of the link before it."""

JOINT_TWISTS = (0, -1, 1, 1, -1, 1, 1)
"""Rotation of each joint's frame about the x axis of the link before it, in quarter turns."""

FLANGE_OFFSET_M = (0.0, 0.0, 0.107)
HAND_YAW_RAD = -pi / 4
FINGER_OFFSET_M = 0.0584
"""Height of the finger frames above the hand's frame."""
TIP_OFFSET_M = 0.1122
"""Height of the finger tips above the hand's frame."""

JOINT_LOWER_RAD = np.array([-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159])
JOINT_UPPER_RAD = np.array([2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159])
JOINT_VELOCITY_RAD_S = np.array([2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26])
JOINT_TORQUE_NM = np.array([87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0])
JOINT_ARMATURE_KG_M2 = np.array([0.195, 0.195, 0.195, 0.195, 0.074, 0.074, 0.074])
JOINT_DAMPING_NM_S = 0.21


@dataclass(frozen=True, kw_only=True, slots=True)
class LinkInertia:
    """A rigid link's inertia, in the link's frame; about its centre of mass.

    Attributes:
        mass_kg: Mass.
        centre_m: Centre of mass.
        inertia: ``xx yy zz xy xz yz`` [kg m^2].
    """

    mass_kg: float
    centre_m: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


LINKS = (
    LinkInertia(
        mass_kg=2.3966,
        centre_m=(-0.0172, 0.0004, 0.0745),
        inertia=(0.0090, 0.0115, 0.0085, 0.0, 0.0020, 0.0),
    ),
    LinkInertia(
        mass_kg=2.9274653454,
        centre_m=(0.0000004128, -0.0181251324, -0.0386035970),
        inertia=(0.0239273165, 0.0224821613, 0.0063500983, 0.0000133179, -0.0001140477, -0.0019950321),
    ),
    LinkInertia(
        mass_kg=2.9355370338,
        centre_m=(0.0031828864, -0.0743221644, 0.0088146084),
        inertia=(0.0419389463, 0.0251451489, 0.0617021447, 0.0002025733, 0.0040777842, -0.0042252158),
    ),
    LinkInertia(
        mass_kg=2.2449013699,
        centre_m=(0.0407015686, -0.0048200565, -0.0289730823),
        inertia=(0.0241014255, 0.0197405327, 0.0190444945, 0.0024046946, -0.0028562693, -0.0021042127),
    ),
    LinkInertia(
        mass_kg=2.6155955791,
        centre_m=(-0.0459100965, 0.0630492960, -0.0085187868),
        inertia=(0.0345299832, 0.0288816219, 0.0412547117, 0.0132255227, 0.0101514300, -0.0009762834),
    ),
    LinkInertia(
        mass_kg=2.3271207594,
        centre_m=(-0.0016039605, 0.0292536262, -0.0972965990),
        inertia=(0.0516102785, 0.0478772971, 0.0164236256, -0.0057151734, -0.0035673168, 0.0106739851),
    ),
    LinkInertia(
        mass_kg=1.8170376524,
        centre_m=(0.0597131221, -0.0410294666, -0.0101692726),
        inertia=(0.0054123336, 0.0140583295, 0.0160808179, 0.0061934564, 0.0014219289, -0.0013140754),
    ),
    LinkInertia(
        mass_kg=0.6271432862,
        centre_m=(0.0045225817, 0.0086261921, -0.0161633251),
        inertia=(0.0002109239, 0.0001771857, 0.0000599319, -0.0000243330, 0.0000456448, 0.0000874407),
    ),
)
"""Links 0 (the base) to 7."""

HAND = LinkInertia(
    mass_kg=0.6544, centre_m=(-0.0000376, 0.0119128, 0.0207260), inertia=(0.00186, 0.00030, 0.00174, 0.0, 0.0, -0.00002)
)
FINGER = LinkInertia(
    mass_kg=0.0291,
    centre_m=(0.0, 0.0152850, 0.0219675),
    inertia=(0.00000849, 0.00000853, 0.00000177, 0.0, 0.0, -0.00000106),
)
"""In the finger's frame; the right finger's is the left one's turned by half a turn about z."""
