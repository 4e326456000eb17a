"""What CORN's encoder is pretrained as: which patches of an object does the hand touch?"""

from typing import Literal

from jaxtyping import Float
from pydantic import Field
from torch import Tensor, nn

from clutter6d.schema import FileModel
from dapl_baselines.encoders.corn import CornEncoder, CornEncoderConfig, TargetPatches


class ContactModelConfig(FileModel):
    """Sizes of the model; the head's are those of a token, as CORN's are.

    Attributes:
        schema_version: Of these fields.
        encoder: Of the encoder.
    """

    schema_version: Literal[1] = 1
    encoder: CornEncoderConfig = Field(default_factory=CornEncoderConfig)


class ContactModel(nn.Module):
    """The encoder, and a head that every patch's token goes through.

    Args:
        config: Sizes.
    """

    def __init__(self, config: ContactModelConfig) -> None:
        super().__init__()
        self.config = config
        self.encoder = CornEncoder(config.encoder)
        size = config.encoder.token_size
        self.head = nn.Sequential(
            nn.Linear(size, size), nn.GELU(), nn.Linear(size, size), nn.GELU(), nn.Linear(size, 1)
        )

    def forward(self, patches: TargetPatches, hand: Float[Tensor, "row 9"]) -> Float[Tensor, "row 16"]:
        """For each patch the log-odds that a point of it lies in the hand.

        Args:
            patches: Of the objects.
            hand: Position [m] and 6-D rotation, world frame.
        """
        return self.head(self.encoder.encode(patches, hand)[:, :-1])[..., 0]
