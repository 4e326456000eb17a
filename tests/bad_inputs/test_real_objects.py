"""Curated lists, and data sets whose assets the user installs."""

from collections.abc import Callable, Sequence

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

UID = "0" * 32


def listed(content: str) -> Callable[[Workspace], Sequence[str]]:
    """Make a recipe of a list."""

    def make(work: Workspace) -> Sequence[str]:
        (work.path / "list.csv").write_text(content)
        return ["dataset", "recipe", str(work.path / "list.csv"), "--name", "mine", "--out", work.out]

    return make


def curate(*options: str) -> Callable[[Workspace], Sequence[str]]:
    return lambda work: ["assets", "curate", "objaverse", "--out", work.out, *options]


CASES = [
    Case(
        name="curate-from-an-unknown-source",
        make=lambda work: ["assets", "curate", "shapenet", "--out", work.out],
        says=("shapenet", "objaverse"),
    ),
    Case(name="no-object-is-wanted", make=curate("--count", "0"), says=("--count",)),
    Case(name="more-than-all-are-large", make=curate("--large-share", "1.5"), says=("--large-share",)),
    Case(name="licence-unknown", make=curate("--licence", "gpl"), says=("gpl", "by-nc")),
    Case(name="list-without-rows", make=listed("uid,licence\n"), says=("list.csv", "lists no objects")),
    Case(name="list-of-other-things", make=listed("a,b\n1,2\n"), says=("list.csv", "object 1", "uid")),
    Case(name="list-with-a-path-as-uid", make=listed("uid,licence\n../../x,CC0-1.0\n"), says=("object 1", "uid")),
    Case(name="list-names-one-twice", make=listed(f"uid,licence\n{UID},a\n{UID},a\n"), says=(UID, "twice")),
    Case(
        name="list-is-a-folder",
        make=lambda work: ["dataset", "recipe", str(work.library), "--name", "a", "--out", work.out],
        says=("library",),
    ),
    Case(
        name="list-for-a-source-that-takes-none",
        make=lambda work: ["assets", "process", "procedural", "--list", "list.csv", "--out", work.out],
        says=("procedural", "list_file"),
    ),
    Case(name="install-unknown", make=lambda _: ["dataset", "install", "clutter6d-v9"], says=("clutter6d-v9",)),
    Case(
        name="install-what-is-there",
        make=lambda _: ["dataset", "install", "clutter6d-v1"],
        says=("clutter6d-v1 carries its assets",),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_mistake_is_one_clear_line_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert before.items() <= fingerprint(workspace.path).items()
