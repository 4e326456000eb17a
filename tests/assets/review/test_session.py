"""Decisions and their undoing: what they do to the journal and to the library, whatever comes between."""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clutter6d.assets.attribute_change import AttributeChange, changed_asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.journal import ReviewJournal
from clutter6d.assets.review.session import ReviewConflictError, ReviewSession, UnknownVersionError
from clutter6d.errors import InvalidValueError
from tests.assets.review.conftest import hash_of
from tests.box_library import make_box_library

NAME = "box-001"
HEAVIER = AttributeChange(mass_kg=1.7)


def edit(session: ReviewSession, name: str = NAME, change: AttributeChange = HEAVIER) -> None:
    session.decide(session.status().assets[name].content_hash, "edit", change=change)


def undo(session: ReviewSession) -> None:
    undoable = session.status().undoable
    assert undoable is not None
    session.undo(undoable.entry_id)


def hashes(library: AssetLibrary) -> dict[str, str]:
    opened = AssetLibrary.open(library.path)
    return {name: opened.load(name).content_hash for name in opened.names(with_rejected=True)}


def test_a_decision_says_who_when_and_on_what(session: ReviewSession, library: AssetLibrary) -> None:
    session.decide(hash_of(library, NAME), "accept")
    (entry,) = ReviewJournal(library.path).entries()
    assert (entry.who, entry.decision, entry.asset_name) == ("ada", "accept", NAME)
    assert entry.asset_hash == entry.result_hash == hash_of(library, NAME)
    assert entry.when.utcoffset().total_seconds() == 0


def test_reopening_goes_on_where_one_stopped(session: ReviewSession, library: AssetLibrary) -> None:
    session.decide(hash_of(library, NAME), "accept")
    session.decide(hash_of(library, "box-002"), "reject", reason="torn")
    again = ReviewSession(AssetLibrary.open(library.path), "ada").status()
    assert {name: getattr(again.decision_on(name), "decision", None) for name in again.assets} == {
        "box-000": None,
        "box-001": "accept",
        "box-002": "reject",
        "box-003": None,
    }


def test_an_edit_makes_a_new_version_that_a_person_answers_for(session: ReviewSession, library: AssetLibrary) -> None:
    before = hash_of(library, NAME)
    edit(session)
    asset = AssetLibrary.open(library.path).load(NAME)
    assert (asset.mass_properties.mass_kg, asset.attributes.mass_from) == (1.7, "person")
    (entry,) = ReviewJournal(library.path).entries()
    assert (entry.asset_hash, entry.result_hash) == (before, asset.content_hash)
    assert [change.model_dump() for change in entry.changes] == [
        {"field": "mass_kg", "before": entry.former.mass_kg, "after": 1.7}
    ]
    assert session.status().decision_on(NAME) == entry


def test_another_version_is_not_reviewed(session: ReviewSession, library: AssetLibrary) -> None:
    session.decide(hash_of(library, NAME), "accept")
    edit(ReviewSession(library, "bob"))
    undo(ReviewSession(library, "bob"))
    assert session.status().decision_on(NAME).decision == "accept"
    edit(ReviewSession(library, "bob"))
    assert session.status().decision_on(NAME).who == "bob"


def test_undoing_an_edit_restores_every_bit(session: ReviewSession, library: AssetLibrary) -> None:
    before = library.load(NAME)
    edit(session, change=AttributeChange(category="brick", colour="red", material="clay", mass_kg=0.1, friction=0.9))
    edit(session, change=AttributeChange(mass_kg=1 / 3))
    undo(session)
    undo(session)
    after = AssetLibrary.open(library.path).load(NAME)
    assert after.attributes == before.attributes
    assert after.mass_properties.inertia.tobytes() == before.mass_properties.inertia.tobytes()
    assert hashes(library) == hashes(library) | {NAME: before.content_hash}
    assert AssetLibrary.open(library.path).verify() == ()


DECISIONS = st.lists(
    st.tuples(st.sampled_from(["accept", "reject", "edit", "undo"]), st.integers(0, 1), st.floats(1e-3, 50)),
    max_size=12,
)


@settings(max_examples=15)
@given(DECISIONS)
def test_whatever_was_decided_undoing_all_of_it_leads_back(decisions: list[tuple[str, int, float]]) -> None:
    folder = Path(tempfile.mkdtemp())
    try:
        library = make_box_library(folder / "library", large=0, small=2)
        session, before = ReviewSession(library, "ada"), hashes(library)
        for verdict, box, mass in decisions:
            file = session.status().assets[f"box-{box:03d}"]
            if verdict == "undo":
                if session.status().undoable is not None:
                    undo(session)
            elif verdict == "edit":
                if (mass, "person") != (file.mass_kg, file.attributes.mass_from):
                    session.decide(file.content_hash, "edit", change=AttributeChange(mass_kg=mass))
            else:
                session.decide(file.content_hash, verdict, reason="torn")
        while session.status().undoable is not None:
            undo(session)
        assert hashes(library) == before
        assert not session.status().decisions
        assert ReviewSession(library, "ada").status() == session.status()
    finally:
        shutil.rmtree(folder)


def test_a_stale_version_cannot_be_decided_on(session: ReviewSession, library: AssetLibrary) -> None:
    stale = hash_of(library, NAME)
    edit(ReviewSession(library, "bob"))
    with pytest.raises(UnknownVersionError, match="may have been changed since"):
        session.decide(stale, "accept")
    with pytest.raises(UnknownVersionError):
        session.load(stale)


def test_a_change_that_is_no_review_is_noticed(session: ReviewSession, library: AssetLibrary) -> None:
    session.decide(hash_of(library, NAME), "accept")
    annotated = changed_asset(library.load(NAME), AttributeChange(material="clay"), by="vlm")
    AssetLibrary.open(library.path).replace(hash_of(library, NAME), annotated)
    status = session.status()
    assert status.assets[NAME].attributes.material == "clay"
    assert status.decision_on(NAME) is None
    assert session.load(annotated.content_hash).name == NAME


def test_an_edit_that_others_built_on_cannot_be_undone(session: ReviewSession, library: AssetLibrary) -> None:
    edit(session)
    edit(ReviewSession(library, "bob"), change=AttributeChange(colour="red"))
    with pytest.raises(ReviewConflictError, match="changed since your edit"):
        undo(session)


def test_a_decision_is_undone_once_and_in_order(session: ReviewSession, library: AssetLibrary) -> None:
    first = session.decide(hash_of(library, NAME), "accept")
    last = session.decide(hash_of(library, "box-002"), "accept")
    with pytest.raises(ReviewConflictError, match="not your last decision"):
        session.undo(first.entry_id)
    session.undo(last.entry_id)
    with pytest.raises(ReviewConflictError):
        session.undo(last.entry_id)
    assert set(session.status().decisions) == {first.result_hash}


class Killed(BaseException):
    """Stands for the process's end."""


@pytest.mark.parametrize("is_undo", [False, True])
def test_a_kill_between_journal_and_library_loses_nothing(
    session: ReviewSession, library: AssetLibrary, monkeypatch: pytest.MonkeyPatch, is_undo: bool
) -> None:
    before = hash_of(library, NAME)
    if is_undo:
        edit(session)

    def die(*_: object) -> None:
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(AssetLibrary, "replace", die)
        with pytest.raises(Killed):
            undo(session) if is_undo else edit(session)
    last = ReviewJournal(library.path).entries()[-1]
    assert hash_of(library, NAME) == last.asset_hash
    again = ReviewSession(AssetLibrary.open(library.path), "ada")
    assert hash_of(library, NAME) == last.result_hash
    assert (last.result_hash == before) == is_undo
    assert (again.status().undoable is None) == is_undo


@pytest.mark.parametrize(
    ("verdict", "options", "says"),
    [
        ("reject", {}, "needs a reason"),
        ("reject", {"reason": "  "}, "needs a reason"),
        ("edit", {}, "at least one new value"),
        ("edit", {"change": AttributeChange()}, "at least one new value"),
        ("accept", {"change": HEAVIER}, "at least one new value"),
    ],
)
def test_half_a_decision_is_refused(
    session: ReviewSession, library: AssetLibrary, verdict: str, options: dict[str, object], says: str
) -> None:
    with pytest.raises(InvalidValueError, match=says):
        session.decide(hash_of(library, NAME), verdict, **options)
    assert ReviewJournal(library.path).entries() == ()


def test_an_edit_that_changes_nothing_is_refused(session: ReviewSession) -> None:
    edit(session)
    with pytest.raises(InvalidValueError, match="has these values already"):
        edit(session)


@pytest.mark.parametrize("name", ["", "  ", "a\nb", "\x1b[31m", "x" * 81])
def test_a_reviewer_has_a_name(library: AssetLibrary, name: str) -> None:
    with pytest.raises(InvalidValueError, match="--reviewer"):
        ReviewSession(library, name)


def test_a_rejected_asset_is_left_out_until_that_is_undone(session: ReviewSession, library: AssetLibrary) -> None:
    session.decide(hash_of(library, NAME), "reject", reason="torn")
    assert NAME not in library.names()
    assert NAME not in set(library.index()["name"])
    assert NAME in library.names(with_rejected=True)
    assert library.verify() == ()
    np.testing.assert_array_equal(library.load(NAME).extents_m, session.load(hash_of(library, NAME)).extents_m)
    undo(session)
    assert NAME in library.names()
