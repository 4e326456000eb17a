"""Asking a model: against a real local server that speaks the protocol."""

import json
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from clutter6d.assets.annotation.annotator import AnnotationFailed, Subject, Usage
from clutter6d.assets.annotation.endpoint import Endpoint
from clutter6d.assets.annotation.endpoint_settings import EndpointSettings, settings_from_environment
from clutter6d.assets.annotation.memory import FOLDER, AnswerMemory
from clutter6d.assets.annotation.vlm import VlmAnnotator
from clutter6d.errors import InvalidValueError, MissingDependencyError
from tests.assets.annotation.endpoint_server import GOOD, KEY, MODEL, Said, failure, good, serve

Make = Callable[..., VlmAnnotator]
AT_ONCE = {"retry_after_ms": "1"}


def test_an_answer_becomes_a_change(subject: Subject, annotator_of: Make) -> None:
    with serve(good()) as server:
        suggestion = annotator_of(server).annotate(subject)
    change = suggestion.change
    assert (change.category, change.colour, change.material) == ("cardboard-box", "brown", "cardboard")
    assert (change.mass_kg, change.friction) == (0.2, 0.5)
    assert suggestion.usage == Usage(answers=1, input_tokens=1000, output_tokens=100)


def test_a_question_has_the_key_the_schema_the_size_and_no_earlier_value(subject: Subject, annotator_of: Make) -> None:
    with serve(good()) as server:
        annotator_of(server).annotate(subject)
    question = server.questions[0]
    said = question["messages"][1]["content"][0]["text"]
    assert server.keys == [f"Bearer {KEY}"]
    assert question["response_format"]["json_schema"]["strict"] is True
    assert "20.0 x 10.0 x 10.0 cm" in said
    assert "2.00 litres" in said
    assert "plastic" not in said


@pytest.mark.parametrize(
    "first",
    [
        Said(text="A box, I think."),
        Said(text=None),
        good(material="unobtainium"),
        good(mass_kg=900),
        Said(text=json.dumps(GOOD)[:40], finish_reason="length"),
    ],
    ids=["prose", "nothing", "unknown material", "mass of a car", "cut off"],
)
def test_a_bad_answer_is_asked_for_once_more(subject: Subject, annotator_of: Make, first: Said) -> None:
    with serve(first, good()) as server:
        suggestion = annotator_of(server).annotate(subject)
    assert suggestion.change.material == "cardboard"
    assert suggestion.usage.answers == 2
    assert "cannot be used" in server.questions[1]["messages"][-1]["content"]


def test_two_bad_answers_are_none(subject: Subject, annotator_of: Make) -> None:
    with serve(good(colour="octarine")) as server, pytest.raises(AnnotationFailed, match="colour: must be") as caught:
        annotator_of(server).annotate(subject)
    assert (caught.value.reason, caught.value.usage.answers, len(server.questions)) == ("unusable-answer", 2, 2)


def test_a_mass_that_does_not_fit_the_volume_is_complained_of(subject: Subject, annotator_of: Make) -> None:
    with serve(good(mass_kg=30), good()) as server:
        suggestion = annotator_of(server).annotate(subject)
    assert suggestion.change.mass_kg == 0.2
    assert "weighs between 0.0015 and 3.25 kg" in server.questions[1]["messages"][-1]["content"]


def test_a_mass_that_does_not_fit_twice_is_left_out_with_a_note(subject: Subject, annotator_of: Make) -> None:
    with serve(good(mass_kg=30)) as server:
        suggestion = annotator_of(server).annotate(subject)
        again = annotator_of(server).annotate(subject)
    assert suggestion.change.mass_kg is None
    assert suggestion.change.category == "cardboard-box"
    assert "mass_kg 30 does not fit cardboard" in suggestion.notes[0]
    assert (again.change, again.notes, len(server.questions)) == (suggestion.change, suggestion.notes, 2)


def test_a_first_answer_is_not_lost_to_a_worse_second(subject: Subject, annotator_of: Make) -> None:
    with serve(good(mass_kg=30), Said(text="sorry")) as server:
        suggestion = annotator_of(server).annotate(subject)
    assert (suggestion.change.material, suggestion.change.mass_kg) == ("cardboard", None)


@pytest.mark.parametrize("status", [408, 409, 429, 500, 503])
def test_a_busy_endpoint_is_asked_again(subject: Subject, annotator_of: Make, status: int) -> None:
    with serve(failure(status, **AT_ONCE), good()) as server:
        assert annotator_of(server).annotate(subject).change.category == "cardboard-box"
    assert len(server.questions) == 2


def test_an_answer_that_breaks_off_on_the_way_is_asked_for_again(subject: Subject, annotator_of: Make) -> None:
    with serve(replace(good(), is_broken_off=True), good()) as server:
        assert annotator_of(server).annotate(subject).change.category == "cardboard-box"


def test_an_answer_that_hangs_is_asked_for_again(subject: Subject, annotator_of: Make) -> None:
    with serve(replace(good(), delay_s=1.5), good()) as server:
        assert annotator_of(server, timeout_s=0.5).annotate(subject).change.category == "cardboard-box"
    assert len(server.questions) == 2


FAILURES = {
    "rate limit": (failure(429, "slow down", **AT_ONCE), "rate-limited", "429: .*slow down"),
    "server error": (failure(500, "oops", **AT_ONCE), "server-error", "500: .*oops"),
    "question refused": (failure(400, "too many pictures"), "question-refused", "too many pictures"),
    "description refused": (Said(text=None, refusal="no"), "refused", "will not describe"),
    "content filter": (Said(text=None, finish_reason="content_filter"), "refused", "will not describe"),
    "a page": (Said(body=b"<html>", headers={"Content-Type": "text/html"}), "no-completion", "something else"),
    "no JSON": (Said(body=b"{"), "no-completion", "something else"),
    "no choices": (Said(body=b"{}"), "no-completion", "no choices"),
    "choices of another kind": (Said(body=b'{"choices": [5]}'), "no-completion", "no choices"),
}


@pytest.mark.parametrize(("said", "reason", "detail"), FAILURES.values(), ids=FAILURES.keys())
def test_a_failure_has_its_reason(subject: Subject, annotator_of: Make, said: Said, reason: str, detail: str) -> None:
    with serve(said) as server, pytest.raises(AnnotationFailed, match=detail) as caught:
        annotator_of(server, retries=1).annotate(subject)
    assert caught.value.reason == reason


def test_a_silent_endpoint_times_out(subject: Subject, annotator_of: Make) -> None:
    with serve(replace(good(), delay_s=1.0)) as server, pytest.raises(AnnotationFailed, match="no answer in 0.2 s"):
        annotator_of(server, timeout_s=0.2, retries=0).annotate(subject)


@pytest.mark.parametrize(
    ("said", "says"),
    [
        (failure(401, f"bad key {KEY}"), "refuses the key \\(401\\).*bad key \\*\\*\\*.*OPENAI_API_KEY"),
        (failure(403, "not yours"), "refuses the key \\(403\\)"),
        (failure(404, "no such model"), "knows no model 'views-1'.*no such model"),
    ],
)
def test_what_no_asset_can_mend_ends_the_run(subject: Subject, annotator_of: Make, said: Said, says: str) -> None:
    with serve(said) as server, pytest.raises(InvalidValueError, match=says) as caught:
        annotator_of(server).annotate(subject)
    assert KEY not in str(caught.value)


def test_an_endpoint_that_knows_no_schemas_is_asked_for_json_then_for_text(
    subject: Subject, annotator_of: Make
) -> None:
    def picky(question: dict) -> Said:
        if "response_format" in question:
            return failure(400, f"unknown response_format {question['response_format']['type']}")
        return good()

    with serve(picky) as server:
        annotator = annotator_of(server)
        assert annotator.annotate(subject).change.category == "cardboard-box"
    forms = [question.get("response_format", {}).get("type") for question in server.questions]
    assert forms == ["json_schema", "json_object", None]


def test_an_answer_is_remembered(subject: Subject, annotator_of: Make) -> None:
    with serve(good()) as server:
        first = annotator_of(server).annotate(subject)
        second = annotator_of(server).annotate(subject)
    assert len(server.questions) == 1
    assert (second.change, second.is_remembered, second.usage) == (first.change, True, Usage())


def test_other_views_another_model_or_another_shape_is_another_question(
    subject: Subject, annotator_of: Make, tmp_path: Path
) -> None:
    memory, other_model = (AnswerMemory(tmp_path / "library" / FOLDER, model) for model in (MODEL, "views-2"))
    with serve(good()) as server:
        annotator_of(server).annotate(subject)
    assert memory.recall(subject) is not None
    assert other_model.recall(subject) is None
    assert memory.recall(replace(subject, views=subject.views[::-1][:3])) is None
    assert memory.recall(replace(subject, asset=replace(subject.asset, name="other"))) is None


def test_a_change_of_what_is_said_is_the_same_question(subject: Subject, annotator_of: Make) -> None:
    asset = subject.asset
    heavier = replace(asset, mass_properties=replace(asset.mass_properties, mass_kg=7.0), content_hash="0" * 64)
    with serve(good()) as server:
        annotator_of(server).annotate(subject)
        assert annotator_of(server).annotate(replace(subject, asset=heavier)).is_remembered


def test_a_damaged_memory_is_asked_for_again(
    subject: Subject, annotator_of: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with serve(good()) as server:
        annotator_of(server).annotate(subject)
        next((tmp_path / "library" / FOLDER).iterdir()).write_text('{"answer": 1}')
        assert not annotator_of(server).annotate(subject).is_remembered
    assert len(server.questions) == 2
    assert "asking again" in caplog.text


def test_the_key_is_in_no_file_no_log_and_no_repr(
    subject: Subject, annotator_of: Make, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG), serve(failure(500, KEY, **AT_ONCE), good()) as server:
        annotator = annotator_of(server)
        annotator.annotate(subject)
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert files
    assert all(KEY.encode() not in path.read_bytes() for path in files)
    assert KEY not in caplog.text
    assert KEY not in repr(vars(annotator))


def test_a_password_in_an_address_is_not_shown() -> None:
    shown = EndpointSettings(model="m", base_url="http://me:secret@localhost:8000/v1/").shown_url
    assert shown == "http://localhost:8000/v1"


def test_an_endpoint_of_ones_own_needs_no_key(
    subject: Subject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with serve(good()) as server:
        settings = settings_from_environment(model=MODEL, base_url=server.url)
        VlmAnnotator(Endpoint(settings), AnswerMemory(tmp_path, MODEL)).annotate(subject)
    assert server.keys == ["Bearer none"]


def test_without_the_client_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openai", None)
    with pytest.raises(MissingDependencyError, match=r'pip install "clutter6d\[vlm\]"'):
        Endpoint(EndpointSettings(model=MODEL))


def test_what_is_not_given_comes_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_BASE_URL", "http://127.0.0.1:9/v1")
    monkeypatch.setenv("CLUTTER6D_VLM_MODEL", "views-9")
    found = settings_from_environment(model=None, base_url=None)
    assert (found.model, found.base_url) == ("views-9", "http://127.0.0.1:9/v1")
    assert settings_from_environment(model="mine", base_url=None).model == "mine"


def test_waiting_for_a_busy_endpoint_takes_longer_each_time(subject: Subject, annotator_of: Make) -> None:
    busy = failure(429)
    with serve(busy, busy, good()) as server:
        start = time.monotonic()
        annotator_of(server, retries=2).annotate(subject)
    assert len(server.questions) == 3
    assert time.monotonic() - start > 0.75 * (0.5 + 1.0)
