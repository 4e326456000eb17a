"""A world model and its optimiser: one step at a time, and all that must be kept to make the next one."""

from typing import Any

import torch
from torch import nn

from clutter6d.errors import Clutter6DError
from dapl_baselines.world_model.batches import Batch
from dapl_baselines.world_model.evaluation import batch_loss
from dapl_baselines.world_model.model import WorldModel
from dapl_baselines.world_model.train_config import RunConfig


class DivergedError(Clutter6DError):
    """The loss is not finite any more."""


class Learner:
    """A world model under AdamW; matrices decay, biases and scales do not.

    Args:
        config: Model, loss and settings.
        device: Where it runs.

    Attributes:
        model: The model.
    """

    def __init__(self, config: RunConfig, device: torch.device) -> None:
        self._config, self._device = config, device
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(config.train.seed)
            self.model = WorldModel(config.model).to(device)
        matrices = [weight for weight in self.model.parameters() if weight.ndim > 1]
        others = [weight for weight in self.model.parameters() if weight.ndim <= 1]
        decays = {"params": matrices, "weight_decay": config.train.weight_decay}
        self._optimiser = torch.optim.AdamW([decays, {"params": others, "weight_decay": 0.0}])

    def make_step(self, batch: Batch, learning_rate: float) -> dict[str, float]:
        """Make one step; returns the loss, its terms and the length of the gradient.

        Raises:
            DivergedError: The loss or the gradient is not finite; the weights are those of before.
        """
        for group in self._optimiser.param_groups:
            group["lr"] = learning_rate
        self.model.train()
        self.model.update_statistics(batch.now)
        is_half = self._config.train.precision == "bfloat16"
        with torch.autocast(self._device.type, dtype=torch.bfloat16, enabled=is_half):
            _, loss = batch_loss(self.model, batch, self._config.loss)
        self._optimiser.zero_grad()
        loss.total.backward()
        norm = nn.utils.clip_grad_norm_(self.model.parameters(), self._config.train.max_gradient_norm)
        if not (torch.isfinite(loss.total) and torch.isfinite(norm)):
            raise DivergedError("the loss is not finite any more; try a lower learning rate in another --out")
        self._optimiser.step()
        values = {"loss": loss.total.detach(), **loss.terms, "gradient_norm": norm}
        return {name: float(value) for name, value in values.items()}

    def state(self) -> dict[str, Any]:
        """Weights, moments of the optimiser, and the state of PyTorch's random numbers."""
        return {
            "model": self.model.state_dict(),
            "optimiser": self._optimiser.state_dict(),
            "random": torch.get_rng_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a state.

        Raises:
            KeyError, TypeError, ValueError, RuntimeError: It is not of this model.
        """
        self.model.load_state_dict(state["model"])
        self._optimiser.load_state_dict(state["optimiser"])
        torch.set_rng_state(state["random"])
