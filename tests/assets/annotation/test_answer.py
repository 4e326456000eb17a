"""Reading a model's text."""

import json

import pytest

from clutter6d.assets.annotation.answer import UnreadableAnswer, answer_schema, parse_answer
from tests.assets.annotation.endpoint_server import GOOD


@pytest.mark.parametrize(
    "text",
    [json.dumps(GOOD), f"```json\n{json.dumps(GOOD, indent=1)}\n```", f"Here it is:\n```\n{json.dumps(GOOD)}\n```\n"],
)
def test_json_is_read_alone_or_fenced(text: str) -> None:
    answer = parse_answer(text)
    assert (answer.category, answer.material, answer.mass_kg) == ("cardboard-box", "cardboard", 0.2)


WRONG = {
    "prose": ("It is a box.", "not JSON"),
    "nothing": ("", "not JSON"),
    "half of it": (json.dumps(GOOD)[:60], "not JSON"),
    "a list": ("[]", "not JSON"),
    "an unknown material": (json.dumps(GOOD | {"material": "unobtainium"}), "material: must be one of ceramic, glass"),
    "an unknown colour": (json.dumps(GOOD | {"colour": "#ff0000"}), "colour: must be one of"),
    "no category": (json.dumps(GOOD | {"category": "  "}), "category: must name"),
    "a sentence for a category": (json.dumps(GOOD | {"category": "a box with a lid on it"}), "category: must name"),
    "another alphabet": (json.dumps(GOOD | {"category": "盒子"}), "category: must name"),
    "no mass": (json.dumps({key: value for key, value in GOOD.items() if key != "mass_kg"}), "mass_kg: Field required"),
    "a negative mass": (json.dumps(GOOD | {"mass_kg": -1}), "mass_kg: must be above 0"),
    "a mass in words": (json.dumps(GOOD | {"mass_kg": "light"}), "mass_kg"),
    "a mass that is not finite": (json.dumps(GOOD | {"mass_kg": float("nan")}), "mass_kg"),
    "a friction of 40": (json.dumps(GOOD | {"friction": 40}), "friction: must be above 0 and at most 4"),
    "one key too many": (json.dumps(GOOD | {"brand": "x"}), "brand"),
    "a book": (json.dumps(GOOD | {"reasoning": "x" * 30_000}), "at most 20,000"),
}


@pytest.mark.parametrize(("text", "says"), WRONG.values(), ids=WRONG.keys())
def test_anything_else_is_refused_with_what_is_wrong(text: str, says: str) -> None:
    with pytest.raises(UnreadableAnswer, match=says):
        parse_answer(text)


def test_the_schema_uses_only_what_every_endpoint_can_enforce() -> None:
    schema = answer_schema()
    assert schema["additionalProperties"] is False
    assert schema["required"] == list(GOOD)
    known = {"type", "enum", "description", "title"}
    assert all(set(item) <= known for item in schema["properties"].values())
