"""The settings of a policy training, and the presets."""

from typing import Final, Literal

from pydantic import Field, model_validator

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.action_scale import ActionScaleCurriculum
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import MAX_CONTROL_STEPS, TerminationConfig
from clutter6d.physics import CONTROL_STEP_S
from clutter6d.schema import FileModel
from dapl_baselines.checkpoint import Precision
from dapl_baselines.policy.config import PolicyNetworkConfig


class PpoSettings(FileModel):
    """PPO, by rsl_rl's names; the defaults are the paper's (Table "PPO Algorithm Hyperparameters").

    Attributes:
        value_loss_coef: Weight of the value loss.
        use_clipped_value_loss: Whether a value may move by ``clip_param`` at most in one iteration.
        clip_param: The clip parameter.
        entropy_coef: Weight of the entropy.
        num_learning_epochs: Epochs over a rollout.
        num_mini_batches: Mini-batches of an epoch.
        learning_rate: At first; rsl_rl's adaptive schedule changes it at every mini-batch, within 1e-5 and 1e-2.
        schedule: ``"adaptive"``: by the divergence of the new policy from the old; or ``"fixed"``.
        gamma: Discount factor.
        lam: Parameter of the generalised advantage estimate.
        desired_kl: Divergence that the adaptive schedule aims at.
        max_grad_norm: Bound on the gradient's norm: that of trunk and actor, and that of the critic's head.
    """

    value_loss_coef: float = Field(default=0.5, ge=0)
    use_clipped_value_loss: bool = True
    clip_param: float = Field(default=0.3, gt=0)
    entropy_coef: float = Field(default=0.006, ge=0)
    num_learning_epochs: int = Field(default=8, ge=1, le=100)
    num_mini_batches: int = Field(default=8, ge=1, le=4096)
    learning_rate: float = Field(default=5e-5, gt=0, le=1)
    schedule: Literal["adaptive", "fixed"] = "adaptive"
    gamma: float = Field(default=0.99, gt=0, le=1)
    lam: float = Field(default=0.95, ge=0, le=1)
    desired_kl: float = Field(default=0.016, gt=0)
    max_grad_norm: float = Field(default=1.0, gt=0)


class TrainingSettings(FileModel):
    """A policy training; the defaults are the paper's where it gives them.

    Attributes:
        schema_version: Of these fields.
        network: The network; ``encoder`` is filled in from what the user names.
        ppo: PPO.
        envs: Environments of each process.
        steps_per_env: Control steps of a rollout; not in the paper, rsl_rl's customary number.
        iterations: Rollouts in all (paper, "Curriculum Learning": about 20,000 a stage).
        seed: Of everything drawn.
        reward_scale: Factor of the reward. Isaac Lab multiplies by the control step, and the paper trains there.
        final_action_scale_rad: Where the action scale ends (paper, "Action Magnitude Curriculum": 0.01).
        curriculum_iterations: Iterations in which the action scale falls from the network's; the paper does not say.
            ``None``: it stays.
        max_steps: Control steps of an episode at most.
        encoder_precision: Of the frozen encoder's matrix products.
        evaluate_every: Iterations between looks at the validation scenes.
        stored_precision: Of the weights in the checkpoints, which are what is looked at.
    """

    schema_version: Literal[1] = 1
    network: PolicyNetworkConfig = PolicyNetworkConfig()
    ppo: PpoSettings = PpoSettings()
    envs: int = Field(default=2048, ge=1, le=1 << 20)
    steps_per_env: int = Field(default=24, ge=1, le=4096)
    iterations: int = Field(default=20_000, ge=1)
    seed: int = Field(default=0, ge=0)
    reward_scale: float = Field(default=CONTROL_STEP_S, gt=0)
    final_action_scale_rad: float = Field(default=0.01, gt=0, le=0.5)
    curriculum_iterations: int | None = Field(default=20_000, ge=1)
    max_steps: int = Field(default=MAX_CONTROL_STEPS, ge=1)
    encoder_precision: Literal["float32", "bfloat16"] = "bfloat16"
    evaluate_every: int = Field(default=500, ge=1)
    stored_precision: Precision = "float32"

    @model_validator(mode="after")
    def _check(self) -> "TrainingSettings":
        if self.network.history > 1:
            raise ValueError("network.history: PPO trains policies without a memory; distil one that has it")
        return self

    def env(self) -> EnvConfig:
        """The environment's configuration."""
        start, curriculum = self.network.action_scale_rad, None
        if self.curriculum_iterations is not None:
            steps = self.curriculum_iterations * self.steps_per_env
            curriculum = ActionScaleCurriculum(steps=steps, start_rad=start, end_rad=self.final_action_scale_rad)
        action = ActionConfig(action_scale_rad=start, curriculum=curriculum)
        return EnvConfig(
            action=action,
            termination=TerminationConfig(max_steps=self.max_steps),
            has_object_states="object_states" in self.network.state_parts,
        )


PRESETS: Final = {
    "paper": TrainingSettings(),
    "laptop": TrainingSettings(
        network=PolicyNetworkConfig(initial_std=0.5),
        ppo=PpoSettings(num_learning_epochs=5, num_mini_batches=4, learning_rate=3e-4),
        envs=64,
        steps_per_env=32,
        iterations=10_000,
        reward_scale=0.01,
        curriculum_iterations=None,
        evaluate_every=200,
    ),
}
"""``paper``: for GPUs. ``laptop``: two cores; small rollouts, a faster start, returns of the size of 10."""
