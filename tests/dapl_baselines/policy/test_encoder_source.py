import pytest
import torch

from clutter6d.errors import InvalidFileError, MissingFileError, UnknownNameError
from dapl_baselines.checkpoint import TrainingRecord, write_checkpoint
from dapl_baselines.encoders.registry import ENCODERS
from dapl_baselines.policy.encoder_source import open_encoder
from dapl_baselines.world_model.model import WorldModel, WorldModelConfig
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, STATE_ONLY, WITH_CORN, WITH_POINTS, make_network

RECORD = TrainingRecord(method="world model", steps=3, unit="optimiser steps", seed=0)


@pytest.mark.parametrize("name", ENCODERS)
def test_a_named_encoder_has_random_weights_that_the_seed_decides(name):
    before = torch.get_rng_state()
    assert open_encoder(name, 0).sha256 == open_encoder(name, 0).sha256 != open_encoder(name, 1).sha256
    assert open_encoder(name, 0).history == ()
    assert open_encoder(name, 0).config.name == name
    assert torch.equal(torch.get_rng_state(), before)


def test_none_is_no_encoder():
    assert open_encoder("none", 0) is None


WORLD_MODEL = WorldModelConfig(encoder=SMALL_ENCODER)


@pytest.mark.parametrize(
    ("architecture", "config", "module"),
    [
        ("policy-network", WITH_POINTS, make_network(WITH_POINTS)),
        ("policy-network", WITH_CORN, make_network(WITH_CORN)),
        ("world-model", WORLD_MODEL, WorldModel(WORLD_MODEL)),
    ],
)
def test_the_encoder_of_a_policy_or_world_model_comes_with_its_history(tmp_path, architecture, config, module):
    path = tmp_path / "x.pt"
    write_checkpoint(path, architecture=architecture, config=config, module=module, history=(RECORD,))
    source = open_encoder(str(path), 0)
    assert (source.config, source.history) == (config.encoder, (RECORD,))
    for name, tensor in module.encoder.state_dict().items():
        assert torch.equal(source.module.state_dict()[name], tensor)


def test_what_is_no_encoder_is_refused(tmp_path):
    with pytest.raises(UnknownNameError, match="did you mean 'dapl'"):
        open_encoder("dappl", 0)
    with pytest.raises(MissingFileError):
        open_encoder(str(tmp_path / "x.pt"), 0)
    path = tmp_path / "state.pt"
    write_checkpoint(path, architecture="policy-network", config=STATE_ONLY, module=make_network(STATE_ONLY))
    with pytest.raises(InvalidFileError, match="without a point encoder"):
        open_encoder(str(path), 0)
