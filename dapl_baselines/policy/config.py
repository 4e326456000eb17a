"""The configuration of a policy network, as it is stored in checkpoints."""

from typing import Annotated, Final, Literal

from pydantic import Field, model_validator

from clutter6d.schema import FileModel
from dapl_baselines.encoders.registry import EncoderConfig

StatePart = Literal[
    "hand_state", "joint_state", "relative_goal", "physics_parameters", "previous_action", "object_states"
]
STATE_SIZES: Final[dict[StatePart, int]] = {
    "hand_state": 9,
    "joint_state": 14,
    "relative_goal": 9,
    "physics_parameters": 5,
    "previous_action": 7,
    "object_states": 15,
}
"""Numbers of each part of the environment state; of ``object_states``, of each object."""

PRIVILEGED: Final[frozenset[StatePart]] = frozenset({"physics_parameters", "object_states"})
"""Parts that only a simulation knows (paper, Table "Summary of our MDP components", its dagger)."""

PAPER_STATE: Final[tuple[StatePart, ...]] = (
    "hand_state",
    "joint_state",
    "relative_goal",
    "physics_parameters",
    "previous_action",
)

HISTORY_HEADS: Final = 4
"""Heads by which the present frame looks at those before it."""

LayerSize = Annotated[int, Field(ge=1, le=4096)]
Layers = Annotated[tuple[LayerSize, ...], Field(min_length=1, max_length=8)]


class PolicyNetworkConfig(FileModel):
    """Architecture of a policy (paper, "Details of Policy Learning", Architecture); the defaults are the paper's.

    Attributes:
        schema_version: Of these fields.
        encoder: The point encoder's configuration, which has its name; it is told of ``hand_state``, which must be one
            of the parts. ``None``: state only.
        state_parts: What the environment state consists of, in this order.
        objects: Objects in ``object_states``, the target first; 0 without that part.
        query_tokens: Queries that the state is projected to; CORN has 16, the paper 1.
        attention_heads: Heads of the cross-attention; CORN has one.
        fusion_sizes: Hidden layers of the fusion MLP; the last is the size of ``g``.
        head_sizes: Hidden layers of the actor's and of the critic's head.
        history: Frames that the policy sees: the present one, and those before it in the episode. The paper speaks of
            temporal cues and gives no number; 1: no memory.
        initial_std: Standard deviation of the actions at first, as a share of the action scale.
        action_scale_rad: Residual at an output of 1; outputs beyond plus or minus 1 are clipped.
    """

    schema_version: Literal[1] = 1
    encoder: EncoderConfig | None = None
    state_parts: tuple[StatePart, ...] = Field(default=PAPER_STATE, min_length=1)
    objects: int = Field(default=0, ge=0, le=64)
    query_tokens: int = Field(default=1, ge=1, le=64)
    attention_heads: int = Field(default=1, ge=1, le=64)
    fusion_sizes: Layers = (512, 256, 128)
    head_sizes: Layers = (64,)
    history: int = Field(default=1, ge=1, le=16)
    initial_std: float = Field(default=1.0, gt=0, le=10)
    action_scale_rad: float = Field(default=0.1, gt=0, le=0.5)

    @model_validator(mode="after")
    def _check_parts(self) -> "PolicyNetworkConfig":
        if len(set(self.state_parts)) != len(self.state_parts):
            raise ValueError("state_parts: a part is named twice")
        if ("object_states" in self.state_parts) != (self.objects > 0):
            raise ValueError("objects: give the number of objects exactly if state_parts has object_states")
        if self.encoder is not None and "hand_state" not in self.state_parts:
            raise ValueError("state_parts: with an encoder, hand_state is one of them")
        if self.history > 1 and self.fusion_sizes[-1] % HISTORY_HEADS:
            raise ValueError(f"fusion_sizes: with a history, the last is a multiple of {HISTORY_HEADS}")
        return self

    def columns_of(self, part: StatePart) -> slice:
        """Where a part is in the environment state."""
        before = self.state_parts[: self.state_parts.index(part)]
        start = sum(self._size_of(each) for each in before)
        return slice(start, start + self._size_of(part))

    @property
    def state_size(self) -> int:
        """Numbers in the environment state."""
        return sum(self._size_of(part) for part in self.state_parts)

    def _size_of(self, part: StatePart) -> int:
        return STATE_SIZES[part] * (self.objects if part == "object_states" else 1)

    @property
    def is_privileged(self) -> bool:
        """Whether it sees what only a simulation knows."""
        return not PRIVILEGED.isdisjoint(self.state_parts)
