import pytest

from clutter6d.envs.tasks import TaskSource
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.sim.model_variation import let_sleep
from clutter6d.sim.scene_model import SceneModel
from tests.scene_fixtures import make_box_scene_set

SCENES = make_box_scene_set(3)


class Counted:
    """Lets objects sleep, and counts how often it is asked to."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, scene: SceneModel) -> SceneModel:
        self.calls += 1
        return let_sleep(scene)


def test_what_is_simulated_is_prepared_once_for_each_scene():
    prepare = Counted()
    source = TaskSource(SCENES, prepare=prepare)
    plain = TaskSource(SCENES).first().model.model.opt.enableflags
    tasks = [source.choose("boxes-0", pair) for pair in (0, 1, 0)] + [source.choose("boxes-1", 0)]
    assert prepare.calls == 2
    assert all(task.model.model.opt.enableflags != plain for task in tasks)
    assert tasks[0].model is tasks[1].model


def test_a_model_that_was_forgotten_is_prepared_again():
    prepare = Counted()
    source = TaskSource(SCENES, kept_models=1, prepare=prepare)
    for name in ("boxes-0", "boxes-1", "boxes-0"):
        source.choose(name, 0)
    assert prepare.calls == 3


def test_a_stream_draws_the_same_tasks_whatever_is_done_to_the_models():
    prepared, plain = TaskSource(SCENES, prepare=let_sleep), TaskSource(SCENES)
    for number in range(6):
        one, other = prepared.draw(4, number), plain.draw(4, number)
        assert (one.scene.scene_id, one.pair_index) == (other.scene.scene_id, other.pair_index)


def test_names_that_are_not_there_are_refused():
    source = TaskSource(SCENES)
    with pytest.raises(UnknownNameError, match="boxes-9"):
        source.choose("boxes-9", 0)
    with pytest.raises(InvalidValueError, match="goal pairs 0 to 1, not 2"):
        source.choose("boxes-0", 2)
    with pytest.raises(InvalidValueError, match="at least 1"):
        TaskSource(SCENES, kept_models=0)
