"""The settings of a distillation, and the presets."""

from typing import Final, Literal

from pydantic import Field, model_validator

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.noise import DISTILLATION_NOISE, NoiseConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.policy.config import PAPER_STATE, PRIVILEGED, PolicyNetworkConfig, StatePart

STUDENT_STATE: Final[tuple[StatePart, ...]] = tuple(part for part in PAPER_STATE if part not in PRIVILEGED)
"""What of the environment state a robot knows."""


class DistillationSettings(FileModel):
    """A distillation. The paper gives the network, the two losses and the noise; all else is ours.

    Attributes:
        schema_version: Of these fields.
        network: The student; ``encoder`` is filled in from what the user names.
        trains_encoder: Whether the encoder learns too; else it is frozen.
        noise_sigma: Standard deviation of each coordinate [m] and velocity [m/s] of each object's point that the
            student sees (paper, "Dynamics Distillation": 0.05).
        envs: Environments.
        steps_per_env: Control steps of all environments before the student learns from them.
        iterations: Rollouts in all.
        teacher_iterations: Iterations in which the share of environments that the teacher acts in falls from all to
            none; 0: the student acts from the start.
        replay_rows: Observations that are learned from: the last so many, and at least those of an iteration.
        updates: Steps of the optimiser in an iteration.
        batch_rows: Observations in each of them.
        learning_rate: Adam's.
        max_grad_norm: Bound on the gradient's norm.
        action_weight: Weight of the action loss.
        latent_weight: Weight of the latent loss, if the teacher has a latent.
        seed: Of everything drawn.
        max_steps: Control steps of an episode at most.
        encoder_precision: Of the encoder's matrix products while it does not learn.
        evaluate_every: Iterations between looks at the validation scenes.
        stored_precision: Of the weights in the checkpoints, which are what is looked at.
    """

    schema_version: Literal[1] = 1
    network: PolicyNetworkConfig = PolicyNetworkConfig(state_parts=STUDENT_STATE, history=4)
    trains_encoder: bool = False
    noise_sigma: float = Field(default=DISTILLATION_NOISE.coordinates_m, ge=0, le=1)
    envs: int = Field(default=1024, ge=1, le=1 << 16)
    steps_per_env: int = Field(default=8, ge=1, le=4096)
    iterations: int = Field(default=2_000, ge=1)
    teacher_iterations: int = Field(default=50, ge=0)
    replay_rows: int = Field(default=100_000, ge=1, le=10_000_000)
    updates: int = Field(default=64, ge=1, le=100_000)
    batch_rows: int = Field(default=1024, ge=1, le=1 << 16)
    learning_rate: float = Field(default=3e-4, gt=0, le=1)
    max_grad_norm: float = Field(default=1.0, gt=0)
    action_weight: float = Field(default=1.0, ge=0)
    latent_weight: float = Field(default=1.0, ge=0)
    seed: int = Field(default=0, ge=0)
    max_steps: int = Field(default=MAX_CONTROL_STEPS, ge=1)
    encoder_precision: Literal["float32", "bfloat16"] = "bfloat16"
    evaluate_every: int = Field(default=100, ge=1)
    stored_precision: Precision = "float32"

    @model_validator(mode="after")
    def _check(self) -> "DistillationSettings":
        if self.network.is_privileged:
            raise ValueError("network.state_parts: a student sees nothing that only a simulation knows")
        return self

    @property
    def rollout_rows(self) -> int:
        """Observations of one iteration."""
        return self.envs * self.steps_per_env

    @property
    def kept_rows(self) -> int:
        """Observations that are learned from."""
        return max(self.replay_rows, self.rollout_rows)

    @property
    def stored_rows(self) -> int:
        """Observations in the replay: those that are learned from, and what a history sees before the oldest."""
        return self.kept_rows + (self.network.history - 1) * self.envs

    def env(self) -> EnvConfig:
        """The environment's configuration, without errors of the observation: those are the student's alone."""
        return EnvConfig(
            action=ActionConfig(action_scale_rad=self.network.action_scale_rad),
            termination=TerminationConfig(max_steps=self.max_steps),
        )

    def noise(self) -> NoiseConfig:
        """How wrong the student's observation is."""
        return NoiseConfig(coordinates_m=self.noise_sigma, velocities_m_s=self.noise_sigma)

    def teacher_share(self, iteration: int) -> float:
        """Share of the environments that the teacher acts in, ``beta`` of DAgger.

        Args:
            iteration: Iterations made before.
        """
        return max(0.0, 1.0 - iteration / self.teacher_iterations) if self.teacher_iterations else 0.0


PRESETS: Final = {
    "paper": DistillationSettings(),
    "laptop": DistillationSettings(
        envs=64,
        steps_per_env=16,
        iterations=1_000,
        replay_rows=50_000,
        updates=16,
        batch_rows=256,
        evaluate_every=50,
    ),
}
"""``paper``: many environments and large batches. ``laptop``: two cores; the replay takes half a gigabyte of disk."""
