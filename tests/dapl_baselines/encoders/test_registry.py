import pytest
import torch
from pydantic import TypeAdapter, ValidationError

from clutter6d.errors import UnknownNameError
from dapl_baselines.encoders.point_encoder import PointEncoder
from dapl_baselines.encoders.registry import ENCODERS, EncoderConfig, find_encoder, make_encoder
from tests.dapl_baselines.cloud_fixtures import make_clouds, make_hands


@pytest.mark.parametrize("name", ENCODERS)
def test_every_encoder_gives_as_many_tokens_of_the_size_it_says(name):
    config = find_encoder(name).config()
    encoder = make_encoder(config).eval()
    assert isinstance(encoder, PointEncoder)
    assert (config.name, config.token_size) == (name, encoder.token_size)
    with torch.inference_mode():
        assert encoder(make_clouds(1), make_hands(1)).shape == (1, encoder.token_count, encoder.token_size)


@pytest.mark.parametrize("name", ENCODERS)
def test_a_stored_configuration_says_by_its_name_of_what_it_is(name):
    config, configurations = find_encoder(name).config(token_size=64), TypeAdapter(EncoderConfig)
    assert configurations.validate_json(config.model_dump_json()) == config
    with pytest.raises(ValidationError, match="dapl"):
        configurations.validate_python({**config.model_dump(), "name": "dalp"})


def test_an_unknown_encoder_is_refused_with_the_known_ones():
    with pytest.raises(UnknownNameError, match="dapl"):
        find_encoder("dalp")
