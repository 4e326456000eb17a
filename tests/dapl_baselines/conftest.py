import pytest

from tests.dapl_baselines.interactions.pushed_boxes import record_pushed_boxes


@pytest.fixture(scope="session")
def pushed_boxes(tmp_path_factory):
    """A small data set of boxes that are pushed about."""
    return record_pushed_boxes(tmp_path_factory.mktemp("interactions"))
