"""The data card: what it says is what was measured, and its pictures are where it says."""

import hashlib
import re
import sys
from pathlib import Path

import pytest
from PIL import Image

from clutter6d.dataset.card import CardOptions, CardStep, card_file, write_card
from clutter6d.dataset.card_subject import CardSubject, open_subject
from clutter6d.dataset.card_tables import count_shared_assets, markdown_table
from clutter6d.dataset.dataset import open_dataset
from clutter6d.dataset.measurement import measure
from clutter6d.errors import InvalidValueError, MissingDependencyError, StorageError, UnknownNameError
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set

ROOT = Path(__file__).resolve().parents[2]
OPTIONS = CardOptions(scenes=1, assets=2, backend="raycast")


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> CardSubject:
    folder = tmp_path_factory.mktemp("card") / "boxes"
    write_box_scene_set(folder)
    return open_subject(str(folder))


@pytest.fixture(scope="module")
def page(subject: CardSubject, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_card(subject, tmp_path_factory.mktemp("docs") / "boxes-card.md", OPTIONS)


def test_it_says_what_a_datasheet_says(page: Path) -> None:
    headings = re.findall(r"^## (.*)$", page.read_text(), re.MULTILINE)
    assert headings == [
        "What is in it", "How hard it is", "How cluttered it is", "Assets", "How it was made", "Uses", "Known limits",
        "Licences and attribution", "Maintenance",
    ]  # fmt: skip


def test_its_figures_are_those_measured(page: Path) -> None:
    text = page.read_text()
    assert "| planar | 50.0 % |" in text
    assert "| another resting face | 50.0 % |" in text
    assert "| straight path blocked | 0.0 % |" in text
    assert "| n (goal pairs) | 4 |" in text
    assert "| Apache-2.0 | test | Clutter6D | 8 |" in text


def test_every_picture_it_shows_is_there_and_no_other(page: Path) -> None:
    shown = re.findall(r"!\[.*?\]\((.*?)\)", page.read_text())
    folder = page.with_suffix("")
    assert sorted(shown) == sorted(f"{folder.name}/{path.name}" for path in folder.iterdir())
    assert {Path(name).name for name in shown} >= {"difficulty.png", "clutter.png", "goals.png", "assets.png"}
    for path in folder.iterdir():
        with Image.open(path) as picture:
            assert min(picture.size) > 100


def test_its_plots_are_the_same_every_time(subject: CardSubject, page: Path, tmp_path: Path) -> None:
    again = write_card(subject, tmp_path / page.name, CardOptions(scenes=0)).with_suffix("")
    assert len(list(again.iterdir())) == 4
    for path in again.iterdir():
        assert path.read_bytes() == (page.with_suffix("") / path.name).read_bytes(), path.name


def test_it_names_the_exact_scenes(subject: CardSubject, page: Path) -> None:
    for scenes in subject.splits.values():
        assert scenes.sha256 in page.read_text()


def test_its_progress_ends(subject: CardSubject, tmp_path: Path) -> None:
    steps: list[CardStep] = []
    write_card(subject, tmp_path / "card.md", CardOptions(scenes=0), steps.append)
    assert (steps[-1].done, steps[-1].total) == (2, 2)


def test_an_unknown_data_set_is_one_clear_error() -> None:
    with pytest.raises(UnknownNameError, match="unknown data set, split or folder of scenes 'clutter6d-v99'"):
        open_subject("clutter6d-v99")


def test_a_page_that_cannot_be_written_is_one_clear_error(subject: CardSubject, tmp_path: Path) -> None:
    (tmp_path / "card").write_text("in the way")
    with pytest.raises((InvalidValueError, StorageError), match="in the way"):
        write_card(subject, tmp_path / "card.md", CardOptions(scenes=0))


def test_out_is_a_page_or_a_folder(tmp_path: Path) -> None:
    assert card_file(tmp_path / "card.md") == tmp_path / "card.md"
    assert card_file(tmp_path) == tmp_path / "data-card.md"
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InvalidValueError, match=r"notes.txt: is a file"):
        card_file(tmp_path / "notes.txt")


def test_assets_shared_by_train_and_test_are_counted() -> None:
    boxes = measure(make_box_scene_set(1))
    assert count_shared_assets({"a-train": boxes, "a-test": boxes}) == 4
    assert count_shared_assets({"a-test": boxes}) is None


def test_a_bar_in_a_cell_does_not_end_it() -> None:
    assert markdown_table(("a", "b"), [("x|y", "1")]).splitlines()[-1] == r"| x\|y | 1 |"


def test_without_matplotlib_it_says_what_to_install(
    subject: CardSubject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingDependencyError, match=r'pip install "clutter6d\[card\]"'):
        write_card(subject, tmp_path / "card.md", OPTIONS)


def test_a_data_set_is_described_with_all_its_splits_and_pools(frozen: Path) -> None:
    subject = open_subject(str(frozen))
    assert list(subject.splits) == ["sparse-train", "sparse-test"]
    assert set(subject.assets["pool"]) == {"train", "test"}
    assert subject.failures.keys() == subject.splits.keys()
    facts = dict(subject.facts)
    assert facts["split sparse-test"] == "track sparse, pool test, seed 2"
    assert facts["manifest SHA-256"] == hashlib.sha256((frozen / "manifest.json").read_bytes()).hexdigest()


def test_one_split_is_described_with_the_assets_it_uses(frozen: Path) -> None:
    subject = open_subject(f"{frozen}/sparse-test")
    used = {item.asset_hash for scene in subject.splits["sparse-test"].scenes for item in scene.objects}
    assert set(subject.assets["content_hash"]) == used
    assert set(subject.assets["pool"]) == {"test"}


def test_the_card_in_the_documentation_is_that_of_the_frozen_data_set() -> None:
    text = (ROOT / "docs" / "data-card.md").read_text()
    dataset = open_dataset("clutter6d-v1")
    assert hashlib.sha256((dataset.path / "manifest.json").read_bytes()).hexdigest() in text
    for split in dataset.manifest.splits:
        assert f"| {split.name} | `{split.scenes_sha256}` |" in text
