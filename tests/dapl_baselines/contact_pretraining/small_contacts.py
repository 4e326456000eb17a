"""A pretraining on contacts that takes seconds; as a script, ``small_contacts.py FOLDER``, so that it can be killed."""

import sys
from pathlib import Path

from clutter6d.assets.asset import Asset
from dapl_baselines.contact_pretraining.contact_model import ContactModelConfig
from dapl_baselines.contact_pretraining.settings import ContactSettings
from dapl_baselines.contact_pretraining.training import ContactTraining
from dapl_baselines.encoders.corn import CornEncoderConfig
from tests.scene_fixtures import make_box_asset

SETTINGS = ContactSettings(
    model=ContactModelConfig(encoder=CornEncoderConfig(patch_hidden_size=16, token_size=16, heads=2)),
    steps=12,
    batch=8,
    learning_rate=1e-2,
    warmup_steps=2,
    save_every=2,
    evaluate_every=4,
    watched=300,
)


def make_boxes() -> list[Asset]:
    """A cube, a plate and a rod."""
    sizes = {"cube": (0.1, 0.1, 0.1), "plate": (0.2, 0.15, 0.02), "rod": (0.03, 0.04, 0.25)}
    return [make_box_asset(name, size) for name, size in sizes.items()]


def make_training(out: Path, settings: ContactSettings = SETTINGS) -> ContactTraining:
    return ContactTraining(make_boxes(), "0" * 64, settings, out)


if __name__ == "__main__":
    for report in make_training(Path(sys.argv[1])).run():
        print(report.step, flush=True)
