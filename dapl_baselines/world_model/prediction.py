"""What a world model predicts."""

from dataclasses import dataclass
from typing import Final

from jaxtyping import Float
from torch import Tensor

STEP_S: Final = 0.1
"""The time from an observation to the next one, the paper's Δt."""

POSITION_UNIT_M: Final = 0.01
VELOCITY_UNIT_M_S: Final = POSITION_UNIT_M / STEP_S
ROTATION_UNIT_RAD: Final = 0.1
"""Units of a head's output and of errors: 1 cm, the velocity that makes 1 cm in a step, and the rotation that moves by
1 cm what is 10 cm from the axis. Moving objects move by about that much in a step, so that heads put out, and
optimisers see, numbers around 1. Being fixed, they keep losses of different runs comparable."""


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Prediction:
    """The points of clouds one step later.

    Attributes:
        positions: Where they are [m], world frame.
        velocities: How they move [m/s], world frame.
    """

    positions: Float[Tensor, "row 1280 3"]
    velocities: Float[Tensor, "row 1280 3"]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class ObjectPrediction(Prediction):
    """As :class:`Prediction`, made from the motion of the target alone; all other points stay where they are.

    Attributes:
        translation: Of the centroid of the target's points [m].
        rotation_6d: Of the target about that centroid, world frame: the first two columns of the matrix, not
            necessarily orthonormal.
    """

    translation: Float[Tensor, "row 3"]
    rotation_6d: Float[Tensor, "row 6"]
