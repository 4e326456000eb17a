import math

import pytest
import torch

from clutter6d.seeding import generator
from dapl_baselines.contact_pretraining.contact_errors import errors_of, logits_of, loss_of
from dapl_baselines.contact_pretraining.contact_model import ContactModel, ContactModelConfig
from dapl_baselines.contact_pretraining.examples import ContactShapes, draw_examples
from tests.dapl_baselines.contact_pretraining.small_contacts import SETTINGS, make_boxes
from tests.dapl_baselines.policy.networks import count


def make_model() -> ContactModel:
    torch.manual_seed(0)
    return ContactModel(SETTINGS.model).eval()


EXAMPLES = draw_examples(ContactShapes.of(make_boxes()), SETTINGS.examples, 300, generator(0, "errors"))


def test_the_published_model_has_0_375_million_parameters():
    assert count(ContactModel(ContactModelConfig())) == 375_038


@torch.no_grad()
def test_the_errors_are_those_of_a_plain_loop():
    model = make_model()
    logits = logits_of(model, EXAMPLES)
    chances = logits.sigmoid().flatten().tolist()
    truths = EXAMPLES.is_touched.flatten().tolist()
    share = sum(truths) / len(truths)
    found = errors_of(model, EXAMPLES)
    loss = -sum(math.log(p if t else 1 - p) for p, t in zip(chances, truths, strict=True)) / len(truths)
    assert found.loss == pytest.approx(loss, rel=1e-5) == float(loss_of(logits, EXAMPLES.is_touched))
    assert found.floor == pytest.approx(-share * math.log(share) - (1 - share) * math.log(1 - share), rel=1e-5)


@torch.no_grad()
@pytest.mark.parametrize(("bias", "precision", "recall"), [(-100.0, 1.0, 0.0), (100.0, None, 1.0)])
def test_precision_and_recall_of_who_says_always_the_same(bias, precision, recall):
    model = make_model()
    model.head[-1].bias.fill_(bias)
    found = errors_of(model, EXAMPLES)
    share = float(EXAMPLES.is_touched.float().mean())
    assert found.precision == pytest.approx(share if precision is None else precision)
    assert found.recall == recall
