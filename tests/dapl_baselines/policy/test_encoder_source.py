import pytest
import torch

from clutter6d.errors import InvalidFileError, MissingFileError, UnknownNameError
from dapl_baselines.checkpoint import TrainingRecord, write_checkpoint
from dapl_baselines.policy.encoder_source import open_encoder
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, STATE_ONLY, WITH_POINTS, make_network

RECORD = TrainingRecord(method="world model", steps=3, unit="optimiser steps", seed=0)


def test_a_named_encoder_has_random_weights_that_the_seed_decides():
    before = torch.get_rng_state()
    assert open_encoder("dapl", 0).sha256 == open_encoder("dapl", 0).sha256 != open_encoder("dapl", 1).sha256
    assert open_encoder("dapl", 0).history == ()
    assert torch.equal(torch.get_rng_state(), before)
    assert open_encoder("none", 0) is None


def test_a_checkpoints_encoder_comes_with_its_history(tmp_path):
    network = make_network(WITH_POINTS)
    path = tmp_path / "x.pt"
    write_checkpoint(path, architecture="policy-network", config=WITH_POINTS, module=network, history=(RECORD,))
    source = open_encoder(str(path), 0)
    assert (source.config, source.history) == (SMALL_ENCODER, (RECORD,))
    for name, tensor in network.encoder.state_dict().items():
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
