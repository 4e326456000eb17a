"""What every point encoder is: clouds and hand poses to tokens."""

from abc import ABC, abstractmethod
from typing import ClassVar

from jaxtyping import Float
from torch import Tensor, nn


class PointEncoder(nn.Module, ABC):
    """An encoder of the points that a policy sees.

    Attributes:
        token_count: Tokens of a cloud.
    """

    token_count: ClassVar[int]

    @property
    @abstractmethod
    def token_size(self) -> int:
        """Size of a token."""

    @abstractmethod
    def forward(
        self, cloud: Float[Tensor, "row 1280 7"], hand: Float[Tensor, "row 9"]
    ) -> Float[Tensor, "row token size"]:
        """The tokens of what is observed.

        Args:
            cloud: 512 points of the target, 512 of the environment, 256 of the end-effector, with ``x y z`` [m], share
                of the mass [kg] and velocity [m/s], world frame.
            hand: The observation's ``hand_state``: position [m] and 6-D rotation, world frame.
        """

    def update_statistics(self, cloud: Float[Tensor, "row 1280 7"]) -> None:
        """Take clouds into the running statistics of the input, if it has any; in evaluation mode nothing happens."""
