"""The world model: a cloud and the end-effector's motion to the cloud 0.1 s later (paper, appendix "Architecture").

The rows of the paper's ablation are values of one configuration, see :mod:`dapl_baselines.world_model.presets`.
"""

from dataclasses import replace
from typing import Literal

import torch
from jaxtyping import Float
from pydantic import Field, model_validator
from torch import Tensor, nn

from clutter6d.schema import FileModel
from dapl_baselines.encoders.dapl import DaplEncoder, DaplEncoderConfig
from dapl_baselines.patches import TARGET
from dapl_baselines.running_statistics import RunningStatistics
from dapl_baselines.world_model.decoder import ActionFusion, PointHeads, PoseHead
from dapl_baselines.world_model.prediction import (
    POSITION_UNIT_M,
    ROTATION_UNIT_RAD,
    STEP_S,
    VELOCITY_UNIT_M_S,
    ObjectPrediction,
    Prediction,
)
from dapl_baselines.world_model.rigid_motion import matrix_from_6d, move_rigidly

Task = Literal["points", "object", "reconstruction"]


class WorldModelConfig(FileModel):
    """What a world model sees and predicts.

    Attributes:
        schema_version: Of these fields.
        task: ``points``: all points one step later. ``object``: the target's pose change in the step.
            ``reconstruction``: the points as they are, without an action.
        predicts: ``displacement``: heads give the change since the input, which is added to it, and which share of its
            velocity a point keeps, if velocities are an input: a fresh model predicts constant velocity, and what is
            learned is what contacts change. ``coordinates``: heads give coordinates and velocities themselves, as the
            paper's text has it. A point's place must then pass through the 128 numbers of its patch, which cannot
            compete with copying the input.
        encoder: The encoder.
    """

    schema_version: Literal[1] = 1
    task: Task = "points"
    predicts: Literal["displacement", "coordinates"] = "displacement"
    encoder: DaplEncoderConfig = Field(default_factory=DaplEncoderConfig)

    @model_validator(mode="after")
    def _reconstruction_is_not_given_its_answer(self) -> "WorldModelConfig":
        if self.task == "reconstruction" and self.predicts == "displacement":
            raise ValueError("predicts: a reconstruction must predict 'coordinates'; its displacement is always zero")
        return self

    @property
    def sees_velocity(self) -> bool:
        """Whether the points' velocities are an input."""
        return self.encoder.features != "xyz"


class WorldModel(nn.Module):
    """Encoder, action and decoder.

    Args:
        config: What it sees and predicts.
    """

    def __init__(self, config: WorldModelConfig) -> None:
        super().__init__()
        sizes = config.encoder
        self.config = config
        self.encoder = DaplEncoder(sizes)
        self.fusion = ActionFusion(sizes.token_size, sizes.heads, sizes.mlp_ratio)
        self._keeps_velocity = config.predicts == "displacement" and config.sees_velocity
        outputs = 4 if self._keeps_velocity else 3
        self.heads = PoseHead(sizes.token_size) if config.task == "object" else PointHeads(sizes.token_size, outputs)
        self.coordinates = RunningStatistics(groups=(3,))

    def forward(self, cloud: Float[Tensor, "row 1280 7"], flow: Float[Tensor, "row 3"]) -> Prediction:
        """The clouds one step later.

        Args:
            cloud: Points now, as :meth:`DaplEncoder.forward` takes them.
            flow: Displacement of the end-effector in the step [m], world frame, the paper's a_t. A reconstruction does
                not look at it.

        Returns:
            Positions and velocities; an :class:`ObjectPrediction` if the task is ``object``.
        """
        encoded = self.encoder.encode(cloud)
        is_reconstruction = self.config.task == "reconstruction"
        tokens = self.fusion(encoded.tokens, torch.zeros_like(flow) if is_reconstruction else flow)
        if isinstance(self.heads, PoseHead):
            return _move_target(cloud[..., :3], self.heads(tokens))
        return self._point_prediction(cloud, *self.heads(replace(encoded, tokens=tokens), cloud[..., :3]))

    def update_statistics(self, cloud: Float[Tensor, "row 1280 7"]) -> None:
        """Take clouds into all running statistics; in evaluation mode nothing happens."""
        self.encoder.update_statistics(cloud)
        self.coordinates.update(cloud[..., :3])

    def _point_prediction(
        self,
        cloud: Float[Tensor, "row 1280 7"],
        position_output: Float[Tensor, "row 1280 output"],
        velocity_output: Float[Tensor, "row 1280 output"],
    ) -> Prediction:
        if self.config.predicts == "coordinates":
            positions = self.coordinates.undo(position_output)
            return Prediction(positions=positions, velocities=VELOCITY_UNIT_M_S * velocity_output)
        positions = cloud[..., :3] + POSITION_UNIT_M * position_output[..., :3]
        velocities = VELOCITY_UNIT_M_S * velocity_output[..., :3]
        # Who does not see velocities is not given them here either.
        if self._keeps_velocity:
            positions = positions + STEP_S * (1 + position_output[..., 3:]) * cloud[..., 4:]
            velocities = velocities + (1 + velocity_output[..., 3:]) * cloud[..., 4:]
        return Prediction(positions=positions, velocities=velocities)


def _move_target(positions: Float[Tensor, "row 1280 3"], output: Float[Tensor, "row 9"]) -> ObjectPrediction:
    translation = POSITION_UNIT_M * output[:, :3]
    no_rotation = output.new_tensor([1.0, 0, 0, 0, 1, 0])
    rotation_6d = no_rotation + ROTATION_UNIT_RAD * output[:, 3:]
    target = move_rigidly(positions[:, TARGET.of_cloud], translation, matrix_from_6d(rotation_6d))
    moved = torch.cat([target, positions[:, TARGET.points :]], dim=1)
    return ObjectPrediction(
        positions=moved,
        velocities=(moved - positions) / STEP_S,
        translation=translation,
        rotation_6d=rotation_6d,
    )
