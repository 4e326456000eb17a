import numpy as np
import pytest

from dapl_baselines.serving.observation_check import check_observation, describe_fields
from dapl_baselines.serving.wire import WireError

FIELDS = ("joint_state", "object_points")


def without(name):
    return lambda entries: {key: value for key, value in entries.items() if key != name}


def with_entry(name, value):
    return lambda entries: {**entries, name: value}


def with_number(value):
    def apply(entries):
        wrong = entries["object_points"].copy()
        wrong[511, 6] = value
        return {**entries, "object_points": wrong}

    return apply


def test_what_a_policy_needs_is_taken_and_the_rest_left(observation):
    checked = check_observation(observation, FIELDS)
    assert tuple(checked) == FIELDS
    assert all(np.array_equal(checked[name], observation[name]) for name in FIELDS)


def test_a_client_is_told_types_and_shapes():
    assert describe_fields(("object_points",)) == {"object_points": {"dtype": "float32", "shape": [512, 7]}}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without("joint_state"), "entry 'joint_state' is missing"),
        (with_entry("prompt", "push it"), "unknown entry 'prompt'"),
        (with_entry("x" * 1000, 1), "unknown entry 'xxx"),
        (with_entry(b"joint_state", 1), "unknown entry"),
        (with_entry("joint_state", np.zeros(14)), r"is float64\(14,\), expected float32\(14,\)"),
        (with_entry("joint_state", np.zeros((1, 14), np.float32)), r"is float32\(1, 14\)"),
        (with_entry("joint_state", [0.0] * 14), "is list"),
        (with_entry("joint_state", None), "is NoneType"),
        (with_number(np.nan), "'object_points' holds values that are not finite"),
        (with_number(-np.inf), "not finite"),
        (lambda _: [1, 2], "the message holds list"),
        (lambda _: None, "the message holds NoneType"),
    ],
)
def test_anything_else_is_refused_in_one_line(observation, change, said):
    with pytest.raises(WireError, match=said) as caught:
        check_observation(change(observation), FIELDS)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400
