"""What a file of tensors may hold; hostile files are tried in test_checkpoint.py and tests/bad_inputs."""

import pytest
import torch

from clutter6d.errors import InvalidFileError, MissingFileError
from dapl_baselines.code_hash import code_sha256
from dapl_baselines.tensor_file import read_tensor_file, write_tensor_file


def test_tensors_and_plain_values_come_back_as_they_were(tmp_path):
    content = {"step": 3, "rate": 0.1, "names": ["a", "b"], "nested": {"w": torch.arange(4, dtype=torch.uint8)}}
    write_tensor_file(tmp_path / "state.pt", content)
    found = read_tensor_file(tmp_path / "state.pt")
    assert torch.equal(found["nested"].pop("w"), content["nested"].pop("w"))
    assert found == content


def test_messages_say_what_the_file_should_be(tmp_path):
    with pytest.raises(MissingFileError, match="training state not found"):
        read_tensor_file(tmp_path / "state.pt", what="training state")
    (tmp_path / "state.pt").write_text("prose")
    with pytest.raises(InvalidFileError, match="not a training state"):
        read_tensor_file(tmp_path / "state.pt", what="training state")


def test_the_code_has_one_hash():
    assert code_sha256() == code_sha256()
    assert len(code_sha256()) == 64
