"""Keyed randomness: the same name gives the same numbers, for ever and everywhere."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clutter6d.seeding import generator, seed_words

names = st.one_of(st.integers(-(2**40), 2**40), st.text(max_size=12))
paths = st.lists(names, max_size=4).map(tuple)


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ((), [831771675, 1246950599, 3977118987]),
        (("dense",), [2696079908, 593579737, 2833416455]),
        (("dense", "test", 3, "placement"), [69046886, 2779311747, 1928029352]),
        ((0,), [3244203844, 854303612, 1565245146]),
    ],
)
def test_streams_never_change_between_versions(path: tuple[str | int, ...], expected: list[int]) -> None:
    assert generator(0, *path).integers(0, 2**32, size=3).tolist() == expected


@given(st.integers(0, 2**64), paths, paths)
def test_different_names_give_different_streams(
    seed: int, first: tuple[str | int, ...], second: tuple[str | int, ...]
) -> None:
    assert (seed_words(seed, *first) == seed_words(seed, *second)) == (first == second)


@given(paths)
def test_different_seeds_give_different_streams(path: tuple[str | int, ...]) -> None:
    assert seed_words(0, *path) != seed_words(1, *path)


def test_a_number_and_its_text_are_different_names() -> None:
    assert seed_words(0, 1) != seed_words(0, "1")
    assert seed_words(0, "a", "b") != seed_words(0, "a, b")


def test_numpy_integers_name_the_same_stream_as_pythons() -> None:
    assert seed_words(np.int64(3), np.str_("scene"), np.int32(5)) == seed_words(3, "scene", 5)


def test_another_process_draws_the_same() -> None:
    script = "from clutter6d.seeding import generator; print(generator(7, 'dense', 3).random().hex())"
    shown = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60)
    assert shown.stdout.strip() == generator(7, "dense", 3).random().hex()


def test_the_global_generator_is_left_alone() -> None:
    before = np.random.get_state()[1].copy()
    generator(0, "anything").normal(size=100)
    np.testing.assert_array_equal(np.random.get_state()[1], before)
