from itertools import pairwise

import pytest

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.action_scale import ActionScaleCurriculum
from clutter6d.errors import InvalidValueError

CURRICULUM = ActionScaleCurriculum(steps=1000)


def test_the_scale_falls_from_the_papers_first_value_to_its_last():
    scales = [CURRICULUM.at(step) for step in range(0, 1201, 100)]
    assert scales[0] == 0.1
    assert scales[10:] == [0.01, 0.01, 0.01]
    assert all(after < before for before, after in pairwise(scales[:11]))


def test_equal_numbers_of_steps_take_off_equal_shares():
    assert CURRICULUM.at(500) == pytest.approx((0.1 * 0.01) ** 0.5)
    assert CURRICULUM.at(700) / CURRICULUM.at(600) == pytest.approx(CURRICULUM.at(200) / CURRICULUM.at(100))


def test_a_mapping_takes_its_scale_from_the_curriculum():
    config = ActionConfig(curriculum=CURRICULUM)
    assert config.at(0).action_scale_rad == 0.1
    assert config.at(5000).action_scale_rad == 0.01
    assert config.at(5000).max_hand_step_m == config.max_hand_step_m


def test_without_a_curriculum_the_mapping_stays():
    config = ActionConfig()
    assert config.at(10**9) is config


@pytest.mark.parametrize("settings", [{"steps": 0}, {"steps": 10, "end_rad": 0.2}, {"steps": 10, "end_rad": 0.0}])
def test_impossible_curricula_are_refused(settings):
    with pytest.raises(InvalidValueError):
        ActionScaleCurriculum(**settings)
