"""Curation: a list by licence, size and category, the same for the same seed, resumable, and attributed."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from clutter6d.assets.curation import CurationSettings, CurationState, curate, partial_path
from clutter6d.assets.library import AssetLibrary
from clutter6d.assets.processing import ProcessingSettings
from clutter6d.assets.run import RunSettings, run, settings_as_stored
from clutter6d.assets.sources.objaverse import ObjaverseSource
from clutter6d.assets.sources.objaverse_list import read_list
from clutter6d.errors import InvalidFileError, InvalidValueError, StorageError, UnknownNameError
from tests.assets.sources.test_objaverse import LocalObjaverse

CATEGORIES = ("mug", "bowl", "teapot")


def annotation(number: int, **changes: Any) -> dict[str, Any]:
    """What Objaverse states of one object; the structure is that of its annotations, the content is invented."""
    uid = f"{number:032x}"
    stated = {
        "uid": uid,
        "name": f'Thing "{number}", déjà-vu',
        "license": "by" if number % 2 else "cc0",
        "viewerUrl": f"https://sketchfab.com/3d-models/{uid}",
        "user": {"username": f"maker{number}", "displayName": f"Maker {number}"},
        "vertexCount": 1000 + number,
        "faceCount": 2000 + number,
        "archives": {"glb": {"size": 90_000, "vertexCount": 1000, "faceCount": 2000}},
        "isAgeRestricted": False,
    }
    return stated | changes


class Objaverse:
    """The package's functions over invented annotations: 40 objects of each category."""

    def __init__(self, **spoiled: dict[str, Any]) -> None:
        self.annotations = {item["uid"]: item for item in (annotation(number) for number in range(120))}
        for changes in spoiled.values():
            uid = f"{changes.pop('number'):032x}"
            self.annotations[uid] = self.annotations[uid] | changes
        self.asked: list[int] = []

    def load_lvis_annotations(self) -> Mapping[str, list[str]]:
        uids = list(self.annotations)
        return {name: uids[column::3] for column, name in enumerate(CATEGORIES)} | {"zebra": []}

    def load_annotations(self, uids: list[str]) -> Mapping[str, Any]:
        self.asked.append(len(uids))
        return {uid: self.annotations[uid] for uid in uids if uid in self.annotations}

    def load_objects(self, uids: list[str]) -> Mapping[str, str]:
        raise AssertionError("nothing is downloaded to choose")


def finish(package: Objaverse, settings: CurationSettings, out: Path) -> CurationState:
    return list(curate(package, settings, out))[-1]


def test_cohorts_are_balanced_and_categories_take_turns(tmp_path: Path) -> None:
    finish(Objaverse(), CurationSettings(count=20), tmp_path / "list.csv")
    listed = read_list(tmp_path / "list.csv")
    assert Counter(item.size_class for item in listed) == {"large": 10, "small": 10}
    assert all((item.longest_cm >= 25) == (item.size_class == "large") for item in listed)
    assert set(Counter(item.category for item in listed).values()) <= {4, 5, 6, 7, 8, 9, 10}
    assert {item.category for item in listed} == set(CATEGORIES)


def test_the_list_carries_what_an_attribution_needs(tmp_path: Path) -> None:
    finish(Objaverse(), CurationSettings(count=5), tmp_path / "list.csv")
    for item in read_list(tmp_path / "list.csv"):
        number = int(item.uid, 16)
        assert item.author == f"Maker {number}"
        assert item.licence == ("CC-BY-4.0" if number % 2 else "CC0-1.0")
        assert item.title == f'Thing "{number}", déjà-vu'
        assert item.url.endswith(item.uid)
        assert (item.vertices, item.faces, item.glb_bytes) == (1000 + number, 2000 + number, 90_000)


def test_the_seed_decides_the_list(tmp_path: Path) -> None:
    lists = []
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        finish(Objaverse(), CurationSettings(count=12, seed=seed), tmp_path / name)
        lists.append((tmp_path / name).read_bytes())
    assert lists[0] == lists[1] != lists[2]


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"license": "by-nc"}, "licence"),
        ({"license": "by-nd"}, "licence"),
        ({"license": None}, "licence"),
        ({"vertexCount": 50_001}, "too-many-vertices"),
        ({"faceCount": 50_001}, "too-many-faces"),
        ({"archives": {"glb": {"size": 5_000_001}}}, "too-large"),
        ({"isAgeRestricted": True}, "age-restricted"),
        ({"license": "by", "user": {}}, "no-author"),
        ({"user": "nobody"}, "no-annotation"),
        ({"uid": "../../etc"}, "no-annotation"),
    ],
)
def test_what_does_not_pass_is_counted_by_reason(tmp_path: Path, changes: dict[str, Any], reason: str) -> None:
    package = Objaverse(one={"number": 7} | changes)
    state = finish(package, CurationSettings(count=120, large_share=0.0), tmp_path / "list.csv")
    assert state.refused[reason] == 1
    assert f"{7:032x}" not in {item.uid for item in state.chosen}


def test_other_licences_and_categories_pass_when_they_are_asked_for(tmp_path: Path) -> None:
    package = Objaverse(one={"number": 0, "license": "by-nc"})
    settings = CurationSettings(count=120, licences=("by-nc",), categories=("mug",))
    state = finish(package, settings, tmp_path / "list.csv")
    assert [(item.category, item.licence) for item in state.chosen] == [("mug", "CC-BY-NC-4.0")]
    with pytest.raises(UnknownNameError, match="unknown LVIS category 'mugg'"):
        finish(package, CurationSettings(categories=("mugg",)), tmp_path / "other.csv")
    with pytest.raises(UnknownNameError, match="unknown Objaverse licence 'gpl'"):
        CurationSettings(licences=("gpl",))


def test_a_killed_run_goes_on_and_gives_the_same_list(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clutter6d.assets.curation._BATCH", 10)
    settings = CurationSettings(count=30)
    finish(Objaverse(), settings, tmp_path / "whole.csv")
    steps = curate(Objaverse(), settings, tmp_path / "list.csv")
    next(steps), next(steps), next(steps)
    steps.close()
    assert not (tmp_path / "list.csv").exists()
    with pytest.raises(InvalidValueError, match="other settings"):
        finish(Objaverse(), CurationSettings(count=31), tmp_path / "list.csv")
    again = Objaverse()
    state = finish(again, settings, tmp_path / "list.csv")
    assert sum(again.asked) == state.judged - 20
    assert (tmp_path / "list.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    assert not partial_path(tmp_path / "list.csv").exists()


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"settings": {}, "judged": "x", "refused": [], "chosen": [1]}'])
def test_a_damaged_unfinished_run_is_told(tmp_path: Path, content: str) -> None:
    partial_path(tmp_path / "list.csv").write_text(content)
    with pytest.raises(InvalidFileError, match="remove it to start again"):
        finish(Objaverse(), CurationSettings(), tmp_path / "list.csv")


def test_a_list_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text("mine")
    with pytest.raises(InvalidValueError, match="is there already"):
        finish(Objaverse(), CurationSettings(), tmp_path / "list.csv")


@pytest.mark.parametrize("error", [ConnectionError("offline"), EOFError("cut short"), json.JSONDecodeError("x", "", 0)])
def test_without_the_network_it_is_one_line_and_nothing_is_lost(tmp_path: Path, error: Exception) -> None:
    def fail(uids: list[str]) -> Mapping[str, Any]:
        raise error

    package = Objaverse()
    package.load_annotations = fail
    with pytest.raises(StorageError, match="could not be downloaded .*; try again online"):
        finish(package, CurationSettings(), tmp_path / "list.csv")
    assert not (tmp_path / "list.csv").exists()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "lists no objects"),
        (b"\xff\xfe\x00", "not a CSV file"),
        (b"uid,licence\n../../x,CC0-1.0\n", "object 1, column 'uid'"),
        (b"uid\n" + b"0" * 32 + b"\n", "object 1, column 'licence'"),
        (b"uid,licence\n" + (b"0" * 32 + b",CC0-1.0\n") * 2, "object 2: " + "0" * 32 + " is there twice"),
        (b"uid,licence,vertices\n" + b"0" * 32 + b",CC0-1.0,many\n", "column 'vertices'"),
    ],
)
def test_a_damaged_list_is_told_with_line_and_column(tmp_path: Path, content: bytes, says: str) -> None:
    (tmp_path / "list.csv").write_bytes(content)
    with pytest.raises(InvalidFileError, match=says):
        read_list(tmp_path / "list.csv")


def test_a_list_is_processed_to_the_sizes_it_promises(tmp_path: Path) -> None:
    finish(Objaverse(), CurationSettings(count=2), tmp_path / "list.csv")
    listed = read_list(tmp_path / "list.csv")
    boxes = LocalObjaverse(tmp_path)
    source = ObjaverseSource(list_file=tmp_path / "list.csv", downloader=BoxOf(boxes))
    settings = ProcessingSettings()
    library = AssetLibrary.create(tmp_path / "library", settings_as_stored(settings))
    records = list(run(source, source.objects(), library, settings, RunSettings()))
    assert [(record.status, record.detail) for record in records] == [("accepted", "")] * 2
    made = {asset.licence.source_id: asset for asset in map(library.load, library.names())}
    for item in listed:
        assert made[item.uid].size_class == item.size_class
        assert 100 * made[item.uid].longest_extent_m == pytest.approx(item.longest_cm, abs=0.01)
        assert made[item.uid].licence.author == item.author
        assert made[item.uid].attributes.category == item.category


def test_what_could_not_be_downloaded_is_tried_again_by_the_next_run(tmp_path: Path) -> None:
    finish(Objaverse(), CurationSettings(count=1), tmp_path / "list.csv")
    settings = ProcessingSettings()
    library = AssetLibrary.create(tmp_path / "library", settings_as_stored(settings))
    statuses: list[str] = []
    for package in (LocalObjaverse(tmp_path), BoxOf(LocalObjaverse(tmp_path))):
        source = ObjaverseSource(list_file=tmp_path / "list.csv", downloader=package)
        statuses += [record.status for record in run(source, source.objects(), library, settings, RunSettings())]
    assert statuses == ["rejected", "accepted"]


class BoxOf:
    """Gives one recorded GLB file for any object."""

    def __init__(self, package: LocalObjaverse) -> None:
        from tests.assets.sources.test_objaverse import UID

        self.path = package.load_objects([UID["Blue Mug"]])[UID["Blue Mug"]]

    def load_annotations(self, uids: list[str]) -> Mapping[str, Any]:
        raise AssertionError("a list needs no annotations")

    def load_lvis_annotations(self) -> Mapping[str, list[str]]:
        raise AssertionError("a list needs no categories")

    def load_objects(self, uids: list[str]) -> Mapping[str, str]:
        return dict.fromkeys(uids, self.path)
