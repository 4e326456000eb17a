"""Mistakes met by ``clutter6d dataset card`` and ``clutter6d dataset compare``."""

from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def card(*, dataset: str = "", out: str = "out", options: Sequence[str] = ()) -> Callable[[Workspace], Sequence[str]]:
    def make(work: Workspace) -> Sequence[str]:
        return [
            "dataset",
            "card",
            dataset or str(work.scenes),
            "--out",
            str(work.path / out),
            "--scenes",
            "0",
            *options,
        ]

    return make


def compare(second: str, *options: str) -> Callable[[Workspace], Sequence[str]]:
    def make(work: Workspace) -> Sequence[str]:
        return ["dataset", "compare", str(work.scenes), second.format(path=work.path), *options]

    return make


def file_in_the_way(work: Workspace) -> Sequence[str]:
    (work.path / "docs").write_text("not a folder")
    return card(out="docs/card.md")(work)


def page_is_a_folder(work: Workspace) -> Sequence[str]:
    (work.path / "card.md").mkdir()
    return card(out="card.md")(work)


def text_file(work: Workspace) -> Sequence[str]:
    (work.path / "notes.txt").write_text("precious")
    return card(out="notes.txt")(work)


def scene_damaged(work: Workspace) -> Sequence[str]:
    (work.scenes / "scenes" / "boxes-0" / "scene.json").write_text("{}")
    return card()(work)


def compared_page_is_a_folder(work: Workspace) -> Sequence[str]:
    return compare("{path}/scenes", "--out", str(work.library))(work)


CASES = [
    Case(name="data-set-unknown", make=card(dataset="clutter6d-v99"), says=("unknown data set", "clutter6d-v99")),
    Case(name="folder-of-something-else", make=card(dataset=str(Path(__file__).parent)), says=("unknown data set",)),
    Case(name="out-in-a-file", make=file_in_the_way, says=("cannot write", "docs is in the way")),
    Case(name="page-is-a-folder", make=page_is_a_folder, says=("card.md is a folder",)),
    Case(name="out-is-another-file", make=text_file, says=("notes.txt", "give a folder, or a page")),
    Case(name="scene-damaged", make=scene_damaged, says=("boxes-0", "not a valid scene file")),
    Case(
        name="fewer-than-no-scenes",
        make=card(options=("--scenes", "-1")),
        says=("--scenes", "greater than or equal to 0"),
    ),
    Case(
        name="no-asset-to-show", make=card(options=("--assets", "0")), says=("--assets", "greater than or equal to 1")
    ),
    Case(
        name="backend-unknown",
        make=card(options=("--scenes", "1", "--backend", "vulkan")),
        says=("unknown", "'vulkan'", "raycast"),
    ),
    Case(name="compared-with-nothing", make=compare("{path}/nowhere"), says=("unknown data set", "nowhere")),
    Case(name="compared-page-is-a-folder", make=compared_page_is_a_folder, says=("is a folder", "compare.md")),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_mistake_is_one_clear_line_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert before.items() <= fingerprint(workspace.path).items()
