"""Comparing: equal sets are told equal, and different ones differ where they do."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ks_2samp

from clutter6d.dataset.compare import MeasuredSplit, compare_datasets, ks_distance, pair_splits
from clutter6d.dataset.compare_page import comparison_page, comparison_tables
from clutter6d.dataset.figures import show
from clutter6d.dataset.measurement import measure
from clutter6d.seeding import generator
from tests.bad_inputs.harness import run_command
from tests.scene_fixtures import make_box_scene_set, write_box_scene_set


def measured_boxes(scenes: int, sha256: str = "a" * 64) -> MeasuredSplit:
    measured = measure(make_box_scene_set(scenes))
    return MeasuredSplit(sha256=sha256, asset_hashes=frozenset(measured.objects["asset_hash"]), measured=measured)


def test_a_set_is_identical_to_itself() -> None:
    one = {"boxes-test": measured_boxes(2)}
    comparison = compare_datasets(one, one)
    assert comparison.is_identical
    assert {item.difference for item in comparison.splits[0].figures} == {0.0}
    assert {item.distance for item in comparison.splits[0].distances} == {0.0}
    assert len(comparison_tables(comparison, "one", "one")) == 1


def test_different_sets_differ_in_assets_and_distances() -> None:
    comparison = compare_datasets({"x": measured_boxes(2)}, {"y": measured_boxes(3, "b" * 64)})
    (split,) = comparison.splits
    assert (split.first_assets, split.second_assets, split.shared_assets) == (8, 12, 8)
    distances = {item.distribution.label: item for item in split.distances}
    assert distances["mass of the target"].distance == 0
    assert distances["longest side of the target"].first_count == 2
    assert distances["gap, target at its start"].distance > 0
    assert not comparison.is_identical


def test_splits_are_paired_by_name_or_because_there_is_no_other() -> None:
    assert pair_splits(["a"], ["b"]) == (("a", "b"),)
    assert pair_splits(["a", "b"], ["b", "c"]) == (("b", "b"),)


def test_a_split_that_only_one_set_has_is_named() -> None:
    first, second = measured_boxes(1), measured_boxes(1)
    comparison = compare_datasets({"a": first, "b": second}, {"b": second, "c": first})
    assert (comparison.only_first, comparison.only_second) == (("a",), ("c",))
    assert not comparison.is_identical
    assert "only in old" in comparison_page(comparison_tables(comparison, "old", "new"))


@given(first=st.integers(0, 500), second=st.integers(0, 500), shift=st.floats(-1, 1))
def test_the_distance_is_that_of_kolmogorov_and_smirnov(first: int, second: int, shift: float) -> None:
    a = generator(first, "a").normal(size=40).round(1)
    b = generator(second, "b").normal(size=25).round(1) + shift
    assert ks_distance(a, b) == pytest.approx(ks_2samp(a, b, method="asymp").statistic)


def test_without_values_there_is_no_distance() -> None:
    assert np.isnan(ks_distance(np.zeros(0), np.ones(3)))


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [(0.0312, "cm", "3.12 cm"), (0.3333, "%", "33.3 %"), (np.pi, "deg", "180 deg"), (12345.6, "", "12,346")],
)
def test_values_are_shown_in_their_unit(value: float, unit: str, shown: str) -> None:
    assert show(value, unit) == shown  # type: ignore[arg-type]


def test_differences_of_shares_are_points() -> None:
    assert show(0.1, "%", is_difference=True) == "+10.0 points"
    assert show(1e-12, "mm", is_difference=True) == "0"


def test_the_exit_code_says_whether_scenes_differ(tmp_path: Path) -> None:
    for count in (1, 2):
        write_box_scene_set(tmp_path / f"boxes-{count}", count)
    one, two = str(tmp_path / "boxes-1"), str(tmp_path / "boxes-2")
    assert run_command(["dataset", "compare", one, two]).code == 0
    assert run_command(["dataset", "compare", one, two, "--exit-code"]).code == 1
    assert run_command(["dataset", "compare", one, one, "--exit-code"]).code == 0


def test_the_page_holds_what_is_printed(tmp_path: Path) -> None:
    for count in (1, 2):
        write_box_scene_set(tmp_path / f"boxes-{count}", count)
    page = tmp_path / "compare.md"
    done = run_command(["dataset", "compare", str(tmp_path / "boxes-1"), str(tmp_path / "boxes-2"), "--out", str(page)])
    assert done.code == 0
    assert "| boxes-1, boxes-2 | different | 4 | 8 | 4 |" in page.read_text()
    assert "gap between obstacles" in done.out
    assert "| gap between obstacles | 0" in page.read_text()
