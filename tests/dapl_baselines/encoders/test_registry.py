import pytest
import torch

from clutter6d.errors import UnknownNameError
from dapl_baselines.encoders.registry import ENCODERS, Encoder, find_encoder
from tests.dapl_baselines.cloud_fixtures import make_clouds


@pytest.mark.parametrize("name", ENCODERS)
def test_every_encoder_gives_as_many_tokens_of_the_size_it_says(name):
    kind = find_encoder(name)
    encoder = kind.build(kind.config()).eval()
    assert isinstance(encoder, Encoder)
    assert kind.config().name == name
    with torch.inference_mode():
        assert encoder(make_clouds(1)).shape == (1, encoder.token_count, encoder.token_size)


def test_an_unknown_encoder_is_refused_with_the_known_ones():
    with pytest.raises(UnknownNameError, match="dapl"):
        find_encoder("dalp")
