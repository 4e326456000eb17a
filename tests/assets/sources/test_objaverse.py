"""Objaverse: chosen by licence, size and author before any download, and attributed afterwards.

The annotations in ``tests/data/objaverse`` are invented; their structure is that of Objaverse 1.0.
"""

import json
from collections.abc import Mapping
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from clutter6d.assets.mesh_io import MeshLimits
from clutter6d.assets.sources.objaverse import PERMISSIVE, ObjaverseSource
from clutter6d.errors import (
    InvalidValueError,
    MeshRejectedError,
    MissingDependencyError,
    StorageError,
    UnknownNameError,
)

DATA = Path(__file__).parents[2] / "data" / "objaverse"
ANNOTATIONS: dict[str, Any] = json.loads((DATA / "annotations.json").read_text(encoding="utf-8"))
UID = {annotation["name"]: uid for uid, annotation in ANNOTATIONS.items()}


class LocalObjaverse:
    """The package's three functions over recorded annotations and GLB files written on demand; counts downloads."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.downloaded: list[str] = []

    def load_annotations(self, uids: list[str]) -> Mapping[str, Any]:
        return {uid: ANNOTATIONS[uid] for uid in uids if uid in ANNOTATIONS}

    def load_lvis_annotations(self) -> Mapping[str, list[str]]:
        return json.loads((DATA / "lvis-annotations.json").read_text(encoding="utf-8"))

    def load_objects(self, uids: list[str]) -> Mapping[str, str]:
        paths: dict[str, str] = {}
        for uid in uids:
            if uid not in ANNOTATIONS:
                continue
            print("Downloaded", uid)
            self.downloaded.append(uid)
            path = self.folder / f"{uid}.glb"
            path.write_bytes(trimesh.Scene(trimesh.creation.box((1.0, 2.0, 3.0))).export(file_type="glb"))
            paths[uid] = str(path)
        return paths


@pytest.fixture
def package(tmp_path: Path) -> LocalObjaverse:
    return LocalObjaverse(tmp_path)


def names(source: ObjaverseSource) -> set[str]:
    return {ANNOTATIONS[item.key]["name"] for item in source.objects()}


def test_only_cc0_and_cc_by_pass_by_default(package: LocalObjaverse):
    source = ObjaverseSource(downloader=package)
    assert names(source) == {"Blue Mug", "Ceramic mug", "Teapot of unknown size", "Façade  <Teapot>"}


def test_other_licences_pass_when_they_are_asked_for(package: LocalObjaverse):
    source = ObjaverseSource(licences=(*PERMISSIVE, "by-nc", "by-nd", "by-sa"), downloader=package)
    assert {"Mug (non-commercial)", "No-derivatives bowl", "Share-alike bowl"} <= names(source)


def test_nothing_is_downloaded_to_choose_and_every_refusal_is_counted(package: LocalObjaverse):
    source = ObjaverseSource(downloader=package)
    source.objects()
    assert package.downloaded == []
    assert source.refused == {
        "licence": 5,
        "too-many-vertices": 1,
        "too-large": 1,
        "no-author": 1,
        "age-restricted": 1,
    }


def test_attribution_travels_with_the_object(package: LocalObjaverse):
    source = ObjaverseSource(uids=[UID["Blue Mug"]], downloader=package)
    (item,) = source.objects()
    assert item.licence.name == "CC-BY-4.0"
    assert item.licence.author == "Anna"
    assert item.licence.source == "objaverse"
    assert item.licence.source_id == item.key == UID["Blue Mug"]
    assert item.licence.url == f"https://sketchfab.com/3d-models/{item.key}"
    assert item.name == f"blue-mug-{item.key[:8]}"


def test_a_category_becomes_a_hint_and_categories_take_turns(package: LocalObjaverse):
    items = ObjaverseSource(categories=["teapot", "mug"], downloader=package).objects()
    assert [item.hints.category for item in items[:2]] == ["mug", "teapot"] or len(items) == 4
    assert {item.hints.category for item in items} == {"mug", "teapot"}


def test_the_count_limits_the_choice(package: LocalObjaverse):
    assert len(ObjaverseSource(count=2, downloader=package).objects()) == 2


def test_limits_are_the_callers(package: LocalObjaverse):
    strict = ObjaverseSource(limits=MeshLimits(max_vertices=1000), downloader=package)
    assert "Blue Mug" not in names(strict)
    assert "Ceramic mug" in names(strict)


def test_loading_downloads_one_object_and_says_nothing(package: LocalObjaverse, capsys: pytest.CaptureFixture[str]):
    source = ObjaverseSource(uids=[UID["Blue Mug"]], downloader=package)
    (item,) = source.objects()
    (visual,) = source.load(item).visual
    assert package.downloaded == [item.key]
    np.testing.assert_allclose(np.ptp(visual.mesh.vertices, axis=0), [1.0, 3.0, 2.0], atol=1e-6)
    assert capsys.readouterr().out == ""


def test_an_object_that_cannot_be_had_is_one_rejection(package: LocalObjaverse, monkeypatch: pytest.MonkeyPatch):
    source = ObjaverseSource(uids=[UID["Blue Mug"]], downloader=package)
    (item,) = source.objects()
    monkeypatch.setattr(package, "load_objects", lambda uids: {})
    with pytest.raises(MeshRejectedError, match="not in Objaverse"):
        source.load(item)

    def offline(uids: list[str]) -> Mapping[str, str]:
        raise ConnectionError("offline")

    monkeypatch.setattr(package, "load_objects", offline)
    with pytest.raises(MeshRejectedError, match="could not be downloaded"):
        source.load(item)
    monkeypatch.setattr(package, "load_annotations", offline)
    with pytest.raises(StorageError, match="annotations could not be downloaded"):
        ObjaverseSource(uids=[UID["Blue Mug"]], downloader=package).objects()


def test_unknown_uids_and_malformed_annotations_are_counted(package: LocalObjaverse, monkeypatch: pytest.MonkeyPatch):
    records = {"a": {"uid": "a", "license": "by", "user": "not a record"}, "b": None}
    monkeypatch.setattr(package, "load_annotations", lambda uids: records)
    source = ObjaverseSource(uids=["a", "b", "c"], downloader=package)
    assert source.objects() == ()
    assert source.refused == {"no-annotation": 3}


def test_fingerprints_follow_the_object_and_the_limits(package: LocalObjaverse):
    source = ObjaverseSource(downloader=package)
    first, second = source.objects()[:2]
    assert source.fingerprint(first) != source.fingerprint(second)
    other = ObjaverseSource(limits=MeshLimits(max_vertices=10), downloader=package)
    assert source.fingerprint(first) != other.fingerprint(first)


def test_wrong_arguments_are_refused(package: LocalObjaverse):
    with pytest.raises(UnknownNameError, match="did you mean 'by-nc'"):
        ObjaverseSource(licences=["by-ncc"], downloader=package)
    with pytest.raises(UnknownNameError, match="unknown LVIS category 'mugg'"):
        ObjaverseSource(categories=["mugg"], downloader=package).objects()
    with pytest.raises(InvalidValueError, match="must not be negative"):
        ObjaverseSource(count=-1, downloader=package)


def test_without_the_package_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'clutter6d\[sources\]'"):
        ObjaverseSource()


def test_it_is_registered_as_an_asset_source():
    (entry,) = entry_points(group="clutter6d.asset_sources", name="objaverse")
    assert entry.load() is ObjaverseSource
