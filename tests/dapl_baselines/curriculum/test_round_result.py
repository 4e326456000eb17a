from math import isnan

from tests.dapl_baselines.curriculum.results import make_result


def test_where_nothing_moved_there_is_no_error():
    assert make_result(1, 0.5).row()["world_model_error_cm"] == 0.4
    assert isnan(make_result(1, 0.5, clouds=0).row()["world_model_error_cm"])


def test_one_line_says_success_disturbance_and_errors():
    assert make_result(2, 0.5).describe() == (
        "round 2: 50.0% of 64 validation episodes succeed, other objects are moved by 1.50 cm; "
        "world model after 120,000 steps: P.E. 0.400 cm (copy 0.400, constant velocity 0.400)"
    )
