"""How well a contact model tells which patches are touched."""

from dataclasses import dataclass
from typing import Final

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from dapl_baselines.contact_pretraining.contact_model import ContactModel
from dapl_baselines.contact_pretraining.examples import ContactExamples

ROWS_AT_ONCE: Final = 256


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactErrors:
    """Of a contact model on some examples.

    Attributes:
        loss: Cross-entropy of a patch [nats].
        floor: Of the one who says of every patch alike how likely it is touched.
        precision: Share of the patches said to be touched that are; 1 if it says so of none.
        recall: Share of those touched that are said to be; 1 if there are none.
    """

    loss: float
    floor: float
    precision: float
    recall: float


def logits_of(model: ContactModel, examples: ContactExamples) -> Float[Tensor, "row 16"]:
    """The model's log-odds that patches are touched."""
    return model(model.encoder.see(examples.target, examples.patches), examples.hand)


def loss_of(logits: Float[Tensor, "row 16"], is_touched: Bool[Tensor, "row 16"]) -> Float[Tensor, ""]:
    """Mean cross-entropy of a patch [nats]."""
    return nn.functional.binary_cross_entropy_with_logits(logits, is_touched.float())


@torch.inference_mode()
def errors_of(model: ContactModel, examples: ContactExamples) -> ContactErrors:
    """The errors of a model on examples."""
    rows = torch.arange(len(examples.hand)).split(ROWS_AT_ONCE)
    logits = torch.cat([logits_of(model, examples.rows(part)) for part in rows])
    is_touched, is_said = examples.is_touched, logits > 0
    share = is_touched.float().mean()
    is_right = (is_said & is_touched).sum()
    floor = loss_of(torch.logit(share, eps=1e-6).expand_as(logits), is_touched)
    return ContactErrors(
        loss=float(loss_of(logits, is_touched)),
        floor=float(floor),
        precision=float(is_right / is_said.sum()) if is_said.any() else 1.0,
        recall=float(is_right / is_touched.sum()) if is_touched.any() else 1.0,
    )
