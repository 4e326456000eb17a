"""`clutter6d assets review` and `reviews`, and what a rejection does to other commands."""

import csv
import io
from pathlib import Path

import pytest

from clutter6d.assets.attribute_change import AttributeChange
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.review.journal import JOURNAL_NAME
from clutter6d.assets.review.server import ReviewServer
from clutter6d.assets.review.session import ReviewSession
from clutter6d.cli import run
from tests.assets.review.conftest import hash_of


@pytest.fixture
def reviewed(library: AssetLibrary) -> AssetLibrary:
    ada, bob = ReviewSession(library, "ada"), ReviewSession(library, "bob")
    ada.decide(hash_of(library, "box-000"), "reject", reason="[bold]torn[/bold], =1+1")
    bob.decide(hash_of(library, "box-001"), "edit", change=AttributeChange(mass_kg=1.5, colour="red"))
    ada.undo(ada.decide(hash_of(library, "box-002"), "accept").entry_id)
    return library


def test_reviews_are_counted_by_reviewer(reviewed: AssetLibrary, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["assets", "reviews", str(reviewed.path)]) == 0
    out = capsys.readouterr().out
    assert "2 of 4 assets reviewed" in " ".join(out.split())
    assert "[bold]torn[/bold], =1+1" in out
    rows = [[cell.strip() for cell in line.split("│")[1:7]] for line in out.splitlines() if "│" in line]
    assert ["ada", "0", "0", "1", "1"] in [row[:5] for row in rows]
    assert ["bob", "0", "1", "0", "0"] in [row[:5] for row in rows]


def test_reviews_are_exported(reviewed: AssetLibrary, tmp_path: Path) -> None:
    assert run(["assets", "reviews", str(reviewed.path), "--csv", str(tmp_path / "reviews.csv")]) == 0
    rows = list(csv.DictReader(io.StringIO((tmp_path / "reviews.csv").read_text())))
    assert [(row["who"], row["decision"], row["asset"], row["is_undone"]) for row in rows] == [
        ("ada", "reject", "box-000", "False"),
        ("bob", "edit", "box-001", "False"),
        ("ada", "accept", "box-002", "True"),
    ]
    assert "colour: brown -> red; mass_kg: " in rows[1]["changes"]
    assert rows[1]["result_hash"] == hash_of(reviewed, "box-001")


def test_a_library_nobody_reviewed_has_no_reviews(library: AssetLibrary, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["assets", "reviews", str(library.path)]) == 0
    assert "0 of 4 assets reviewed" in " ".join(capsys.readouterr().out.split())


def test_the_list_says_what_was_decided(
    reviewed: AssetLibrary, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    assert run(["assets", "list", "--library", str(reviewed.path)]) == 0
    lines = {line.split()[1]: line for line in capsys.readouterr().out.splitlines() if "box-" in line}
    assert "rejected" in lines["box-000"]
    assert "edited" in lines["box-001"]
    assert "accepted" not in lines["box-002"]


def test_no_scene_is_made_of_what_was_rejected(
    reviewed: AssetLibrary, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["generate", "--track", "sparse", "--library", str(reviewed.path), "--out", str(tmp_path / "scenes")]
    assert run([*command, "--scenes", "1"]) == 2
    assert "0 assets can be 'large'" in capsys.readouterr().err


def test_a_reviewed_library_is_verified_with_its_journal(
    reviewed: AssetLibrary, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["assets", "verify", "--library", str(reviewed.path)]) == 0
    assert "4 assets" in capsys.readouterr().out
    with (reviewed.path / JOURNAL_NAME).open("ab") as journal:
        journal.write(b"scribble\n")
    assert run(["assets", "verify", "--library", str(reviewed.path)]) == 2
    assert "line 5 is no review" in capsys.readouterr().out


def test_ctrl_c_ends_a_review_well(
    library: AssetLibrary, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(_server: ReviewServer) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(ReviewServer, "serve_forever", interrupt)
    assert run(["assets", "review", str(library.path), "--no-browser", "--reviewer", "Ada Lovelace"]) == 0
    out = capsys.readouterr().out
    assert "http://127.0.0.1:" in out
    assert "Ada Lovelace" in out
    assert "0 of 4 assets reviewed" in " ".join(out.split())
