import pytest
import torch

from tests.dapl_baselines.interactions.pushed_boxes import record_pushed_boxes
from tests.scene_fixtures import write_box_scene_set

# Sums in another order differ in their last bits: a process that is killed and the test that goes on must count alike.
torch.set_num_threads(1)


@pytest.fixture(scope="session")
def pushed_boxes(tmp_path_factory):
    """A small data set of boxes that are pushed about."""
    return record_pushed_boxes(tmp_path_factory.mktemp("interactions"))


@pytest.fixture
def folder(tmp_path):
    """A folder with two scenes of boxes in it."""
    write_box_scene_set(tmp_path / "scenes", 2)
    return tmp_path
