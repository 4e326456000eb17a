import pytest

from clutter6d.errors import MissingFileError, UnknownNameError
from clutter6d.eval.policy_loading import load_policy
from dapl_baselines.bundled import BUNDLED, FOLDER, find_bundled, open_checkpoint
from dapl_baselines.checkpoint import read_checkpoint
from dapl_baselines.policy.encoder_source import open_point_encoder
from dapl_baselines.validation import open_training_scenes

ENCODERS = ["world-model", "corn-pretrained"]
POLICIES = [name for name in BUNDLED if name not in ENCODERS]
MAX_BYTES = 10_000_000


@pytest.mark.parametrize("name", BUNDLED)
def test_a_bundled_checkpoint_is_small_and_says_how_it_came_about(name):
    path = find_bundled(name)
    assert path.stat().st_size < MAX_BYTES
    header = read_checkpoint(path).header
    assert header.precision == "float16"
    assert header.history
    assert all(record.steps > 0 and len(record.code_sha256) == 64 for record in header.history)
    assert f"`{path.name}`" in (FOLDER / "README.md").read_text()


@pytest.mark.parametrize("name", POLICIES)
def test_bundled_policies_are_found_by_name(name):
    policy = load_policy(name)
    assert policy.name == name
    assert policy.is_privileged == (name != "dapl-pushes")


@pytest.mark.slow
@pytest.mark.parametrize("name", POLICIES)
def test_bundled_policies_were_trained_without_the_scenes_that_are_held_out(name):
    record = read_checkpoint(find_bundled(name)).header.history[-1]
    assert record.split_sha256 == open_training_scenes("sparse-train").training.sha256


def test_another_name_is_refused_with_those_there_are():
    with pytest.raises(UnknownNameError, match="push-teacher"):
        find_bundled("nothing")


@pytest.mark.parametrize("name", BUNDLED)
def test_a_checkpoint_is_opened_by_name_or_by_file(name):
    assert open_checkpoint(name).header == open_checkpoint(str(find_bundled(name))).header
    with pytest.raises(MissingFileError):
        open_checkpoint(f"{name}s")


@pytest.mark.parametrize("name", ENCODERS)
def test_a_name_stands_for_the_encoder_in_its_file(name):
    named, read = (open_point_encoder(choice, 0) for choice in (name, str(find_bundled(name))))
    assert named.sha256 == read.sha256
    assert named.history == read.history
