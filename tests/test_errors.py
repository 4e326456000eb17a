"""The error tree: exit codes, one-line messages, and errors that cross process borders whole."""

import inspect
import pickle
from pathlib import Path

import pytest

from clutter6d import errors
from clutter6d.errors import (
    Clutter6DError,
    InvalidFileError,
    MeshRejectedError,
    MissingFileError,
    UnknownNameError,
    UserError,
)

TREE = [item for _, item in inspect.getmembers(errors, inspect.isclass) if issubclass(item, Clutter6DError)]
SAMPLES = [
    Clutter6DError("something broke"),
    MeshRejectedError("empty", "no faces"),
    UnknownNameError("track", "dens", ["sparse", "dense"]),
    MissingFileError("scene file", Path("scenes/a.json"), "run clutter6d generate first"),
    InvalidFileError("scenes/a.json", "not JSON"),
]


@pytest.mark.parametrize("kind", TREE)
def test_a_users_mistake_exits_with_2_and_everything_else_with_1(kind: type[Clutter6DError]) -> None:
    assert kind.exit_code == (2 if issubclass(kind, UserError) else 1)


def test_the_tree_at_the_top_of_the_file_is_complete() -> None:
    assert errors.__doc__ is not None
    assert not [kind.__name__ for kind in TREE if kind.__name__ not in errors.__doc__]


@pytest.mark.parametrize("error", SAMPLES, ids=lambda error: type(error).__name__)
def test_an_error_crosses_a_process_border_whole(error: Clutter6DError) -> None:
    returned = pickle.loads(pickle.dumps(error))
    assert type(returned) is type(error)
    assert str(returned) == str(error)
    assert vars(returned) == vars(error)


@pytest.mark.parametrize("error", SAMPLES, ids=lambda error: type(error).__name__)
def test_a_message_is_one_line(error: Clutter6DError) -> None:
    assert str(error).strip()
    assert "\n" not in str(error)


def test_an_unknown_name_suggests_the_nearest_and_lists_the_known() -> None:
    message = str(UnknownNameError("track", "modrate", ["sparse", "moderate", "dense"]))
    assert message == "unknown track 'modrate'; did you mean 'moderate'? (known: dense, moderate, sparse)"


def test_an_unknown_name_without_a_neighbour_suggests_nothing() -> None:
    assert "did you mean" not in str(UnknownNameError("track", "zzz", ["sparse"]))
    assert str(UnknownNameError("library", "x", [])) == "unknown library 'x' (known: none)"


def test_a_long_list_of_known_names_is_cut() -> None:
    message = str(UnknownNameError("asset", "zzz", [f"mug-{i:04d}" for i in range(1000)]))
    assert message.endswith("mug-0019, ...)")


def test_a_rejected_mesh_keeps_its_countable_reason() -> None:
    error = MeshRejectedError("too many vertices", "75,910 of at most 50,000")
    assert (error.reason, error.detail) == ("too many vertices", "75,910 of at most 50,000")


def test_a_missing_file_says_what_where_and_what_to_do() -> None:
    assert str(SAMPLES[3]) == "scene file not found: scenes/a.json; run clutter6d generate first"
