"""A library annotated: what is replaced and what is not, failures, repetition, and the end of a hopeless run."""

import io
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from clutter6d.assets.annotation.annotator import Subject, Suggestion
from clutter6d.assets.annotation.plan import (
    AnnotationSettings,
    names_to_annotate,
    open_attributes,
    replaceable_origins,
)
from clutter6d.assets.annotation.report import Prices, annotation_tables, summary_table
from clutter6d.assets.annotation.run import Outcome, annotate_library
from clutter6d.assets.annotation.vlm import VlmAnnotator
from clutter6d.assets.attribute_change import AttributeChange, changed_asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.session import ReviewSession
from clutter6d.errors import InvalidValueError, UnknownNameError
from tests.assets.annotation.conftest import box_by_rule, picture_of
from tests.assets.annotation.endpoint_server import Said, failure, good, serve

Make = Callable[..., VlmAnnotator]
NOW = {"retry_after_ms": "1"}


def annotate(library: AssetLibrary, annotator: VlmAnnotator, draw=picture_of, **settings) -> list[Outcome]:
    chosen = AnnotationSettings(**settings)
    return list(annotate_library(library, names_to_annotate(library, chosen), annotator, draw, chosen))


def name_in(question: dict) -> str:
    return question["messages"][1]["content"][0]["text"].splitlines()[0].removeprefix("File name: ")


def test_every_asset_gets_its_values_and_their_origin(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(lambda question: good(mass_kg=0.1 + int(name_in(question)[-1]) / 10)) as server:
        outcomes = annotate(library, annotator_of(server))
    assert {outcome.status for outcome in outcomes} == {"annotated"}
    for index in range(4):
        asset = AssetLibrary.open(library.path).load(f"box-{index}")
        assert asset.mass_properties.mass_kg == pytest.approx(0.1 + index / 10)
        assert (asset.attributes.category, asset.attributes.category_from) == ("cardboard-box", "vlm")
    assert library.verify() == ()


def test_a_second_run_asks_nothing(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good()) as server:
        annotate(library, annotator_of(server))
        assert annotate(library, annotator_of(server)) == []
        again = annotate(library, annotator_of(server), overwrite=replaceable_origins(["vlm"]))
    assert len(server.questions) == 4
    assert {(outcome.status, outcome.is_remembered) for outcome in again} == {("unchanged", True)}


def test_a_fresh_library_of_the_same_assets_asks_nothing_with_the_old_answers(
    library: AssetLibrary, annotator_of: Make, tmp_path: Path
) -> None:
    fresh = AssetLibrary.create(tmp_path / "fresh")
    for name in library.names():
        fresh.add(library.load(name))
    with serve(good()) as server:
        annotate(library, annotator_of(server))
        outcomes = annotate(fresh, annotator_of(server, folder=library.path))
    assert len(server.questions) == 4
    assert {(outcome.status, outcome.is_remembered) for outcome in outcomes} == {("annotated", True)}
    assert {fresh.load(name).content_hash for name in fresh.names()} == {
        library.load(name).content_hash for name in library.names()
    }


@pytest.mark.parametrize("origin", ["person", "source", "declared"])
def test_a_value_of_better_origin_stays(library: AssetLibrary, annotator_of: Make, origin: str) -> None:
    old = library.load("box-0")
    library.replace(old.content_hash, changed_asset(old, AttributeChange(mass_kg=0.77, colour="red"), by=origin))
    with serve(good()) as server:
        annotate(library, annotator_of(server))
    asset = library.load("box-0")
    assert (asset.mass_properties.mass_kg, asset.attributes.colour) == (0.77, "red")
    assert (asset.attributes.mass_from, asset.attributes.material_from) == (origin, "vlm")


def test_a_persons_value_is_replaced_only_when_that_is_said(library: AssetLibrary, annotator_of: Make) -> None:
    old = library.load("box-0")
    library.replace(old.content_hash, changed_asset(old, AttributeChange(mass_kg=0.77), by="person"))
    with serve(good()) as server:
        annotate(library, annotator_of(server), overwrite=replaceable_origins(["person"]))
    assert library.load("box-0").mass_properties.mass_kg == 0.2


def test_an_asset_with_no_open_value_is_not_asked_for(library: AssetLibrary, annotator_of: Make) -> None:
    every = {f"{name}_from": "source" for name in ("category", "colour", "material", "mass", "friction")}
    library.add(box_by_rule("known", **every))
    with serve(good()) as server:
        annotate(library, annotator_of(server))
    assert "known" not in {name_in(question) for question in server.questions}


def test_a_version_that_a_reviewer_accepted_stays(library: AssetLibrary, annotator_of: Make) -> None:
    ReviewSession(library, "Ada").decide(library.load("box-0").content_hash, "accept")
    with serve(good()) as server:
        annotate(library, annotator_of(server))
        assert "box-0" not in {name_in(question) for question in server.questions}
        annotate(library, annotator_of(server), overwrite=replaceable_origins(["person"]))
    assert "box-0" in {name_in(question) for question in server.questions}


def test_an_asset_that_somebody_changes_meanwhile_keeps_their_change(library: AssetLibrary, annotator_of: Make) -> None:
    def change_it_meanwhile(question: dict) -> Said:
        if name_in(question) == "box-1":
            other = AssetLibrary.open(library.path)
            old = other.load("box-1")
            other.replace(old.content_hash, changed_asset(old, AttributeChange(mass_kg=0.77), by="person"))
        return good()

    with serve(change_it_meanwhile) as server:
        outcomes = {outcome.name: outcome for outcome in annotate(library, annotator_of(server), concurrency=1)}
        annotate(library, annotator_of(server))
    assert (outcomes["box-1"].reason, outcomes["box-2"].status) == ("changed", "annotated")
    assert library.load("box-1").mass_properties.mass_kg == 0.77
    assert library.load("box-1").attributes.material_from == "vlm"
    assert len(server.questions) == 4


def test_an_unknown_origin_is_refused() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'person'"):
        replaceable_origins(["persn"])


def test_only_rules_are_open_unless_said() -> None:
    asset = box_by_rule("box", mass_from="person", colour_from="vlm")
    assert open_attributes(asset, replaceable_origins([])) == {"category", "material", "friction"}
    assert "colour" in open_attributes(asset, replaceable_origins(["vlm"]))


def test_one_bad_asset_does_not_end_the_run(library: AssetLibrary, annotator_of: Make) -> None:
    next((library.path / "assets").glob("box-1-*/geometry.npz")).write_bytes(b"")

    def refuse_one(question: dict) -> Said:
        return failure(400, "this picture offends") if name_in(question) == "box-2" else good()

    with serve(refuse_one) as server:
        outcomes = {outcome.name: outcome for outcome in annotate(library, annotator_of(server))}
    assert {name: outcome.reason or outcome.status for name, outcome in outcomes.items()} == {
        "box-0": "annotated",
        "box-1": "cannot-be-read",
        "box-2": "question-refused",
        "box-3": "annotated",
    }
    assert "offends" in outcomes["box-2"].detail


def test_an_asset_that_cannot_be_drawn_does_not_end_the_run(library: AssetLibrary, annotator_of: Make) -> None:
    def draw(asset):
        if asset.name == "box-1":
            raise ValueError("mesh volume is too small")
        return picture_of(asset)

    with serve(good()) as server:
        statuses = Counter(outcome.status for outcome in annotate(library, annotator_of(server), draw=draw))
    assert statuses == {"annotated": 3, "failed": 1}


def test_what_failed_is_asked_for_by_the_next_run(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good(), good(colour="octarine"), good(colour="octarine"), good()) as server:
        first = annotate(library, annotator_of(server), concurrency=1)
        second = annotate(library, annotator_of(server), concurrency=1)
    assert [outcome.status for outcome in first] == ["annotated", "failed", "annotated", "annotated"]
    assert [(outcome.name, outcome.status) for outcome in second] == [("box-1", "annotated")]


def test_an_endpoint_that_was_never_there_ends_the_run_at_once(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good()) as server:
        annotator = annotator_of(server, retries=0)
    with pytest.raises(InvalidValueError, match="the endpoint failed, unreachable: http://127.0.0.1"):
        annotate(library, annotator)


def test_an_endpoint_that_fails_again_and_again_ends_the_run(library: AssetLibrary, annotator_of: Make) -> None:
    for index in range(4, 12):
        library.add(box_by_rule(f"box-{index}", (0.2 + 0.01 * index, 0.1, 0.1)))
    with (
        serve(good(), failure(500, "broken", **NOW)) as server,
        pytest.raises(InvalidValueError, match="5 times in a row, server-error: 500: .*broken.*is kept"),
    ):
        annotate(library, annotator_of(server, retries=0), concurrency=1)
    annotated = [name for name in library.names() if library.load(name).attributes.mass_from == "vlm"]
    assert len(annotated) == 1


def test_a_wrong_key_ends_the_run(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(failure(401, "who are you")) as server, pytest.raises(InvalidValueError, match="OPENAI_API_KEY"):
        annotate(library, annotator_of(server), concurrency=1)
    assert len(server.questions) <= 3


def test_a_dry_run_asks_nobody_and_writes_nothing(library: AssetLibrary, annotator_of: Make) -> None:
    before = {path: path.read_bytes() for path in library.path.rglob("*") if path.is_file()}
    with serve(good()) as server:
        outcomes = annotate(library, annotator_of(server), is_dry_run=True)
    assert {outcome.status for outcome in outcomes} == {"unasked"}
    assert server.questions == []
    assert {path: path.read_bytes() for path in library.path.rglob("*") if path.is_file()} == before


def test_a_limit_counts_what_is_left_to_do(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good()) as server:
        for _ in range(2):
            annotate(library, annotator_of(server), limit=2)
    assert sorted(name_in(question) for question in server.questions) == [f"box-{index}" for index in range(4)]


def test_questions_are_asked_side_by_side(library: AssetLibrary, annotator_of: Make) -> None:
    waiting: list[int] = []

    def slow(question: dict) -> Said:
        waiting.append(len(server.questions))
        return replace(good(), delay_s=0.5)

    with serve(slow) as server:
        annotate(library, annotator_of(server), concurrency=4)
    assert max(waiting) >= 2


def test_a_subject_says_what_is_open(library: AssetLibrary) -> None:
    class Listener:
        origin, needs_views = "rule", False

        def recall(self, subject: Subject) -> Suggestion:
            return self.annotate(subject)

        def annotate(self, subject: Subject) -> Suggestion:
            assert subject.open == {"category", "colour", "material", "mass_kg", "friction"}
            assert subject.views == ()
            return Suggestion(change=AttributeChange(material="wood"))

    outcomes = annotate(library, Listener())
    assert {tuple(outcome.changes) for outcome in outcomes} == {("material",)}


def text_of(*tables) -> str:
    out = io.StringIO()
    for table in tables:
        Console(width=120, file=out).print(table)
    return out.getvalue()


def test_the_summary_counts_reasons_tokens_and_cost(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good(), good(mass_kg=40), good(mass_kg=40), good(colour="?"), good(colour="?"), good()) as server:
        outcomes = annotate(library, annotator_of(server), concurrency=1)
    said = text_of(*annotation_tables(outcomes, 7, Prices(input_per_million=10.0, output_per_million=40.0)))
    for words in ("3 of 4 assets annotated", "failed: unusable-answer", "with a note", "does not fit cardboard"):
        assert words in said
    assert "6 asked for, 0 remembered" in said
    assert "6,000 in, 600 out" in said
    assert "0.0840" in said


def test_without_prices_the_cost_is_unknown(library: AssetLibrary, annotator_of: Make) -> None:
    with serve(good()) as server:
        outcomes = annotate(library, annotator_of(server))
    assert "unknown: give --price-in" in text_of(summary_table(outcomes, 0, Prices()))
