"""Exports that cannot be: unknown formats, scenes that are not there, places that cannot be written."""

import json
import resource
from collections.abc import Sequence

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command, run_process


def export(work: Workspace, *, scene: str = "", formats: str = "usd", out: str = "") -> Sequence[str]:
    return ["export", str(work.scenes / scene), "--format", formats, "--out", out or work.out]


def file_in_the_way(work: Workspace) -> Sequence[str]:
    path = work.path / "notes.txt"
    path.write_text("not a folder")
    return export(work, out=str(path))


def folder_in_the_way(work: Workspace) -> Sequence[str]:
    (work.path / "there" / "glb" / "boxes-0" / "scene.glb").mkdir(parents=True)
    (work.path / "there" / "glb" / "boxes-0" / "LICENCES.csv").touch()
    return export(work, scene="scenes/boxes-0", formats="glb", out=str(work.path / "there"))


def damaged_scene(work: Workspace) -> Sequence[str]:
    path = work.scenes / "scenes" / "boxes-0" / "scene.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "goal_pairs": []}))
    return export(work, scene="scenes/boxes-0")


def is_file(work: Workspace) -> Sequence[str]:
    return export(work, scene="scenes/boxes-0/scene.json")


CASES = [
    Case(
        name="unknown-format",
        make=lambda work: export(work, formats="mjcf,ufd"),
        says=("unknown export format 'ufd'", "did you mean 'usd'?"),
    ),
    Case(name="no-format", make=lambda work: export(work, formats=","), says=("--format", "mjcf, usd, usdz, glb")),
    Case(
        name="missing-scene",
        make=lambda work: export(work, scene="scenes/boxes-7"),
        says=("boxes-7", "scene set not found"),
    ),
    Case(name="unknown-split", make=lambda work: ["export", "dens-test", "--format", "usd"], says=("dens-test",)),
    Case(
        name="scene-not-in-the-split",
        make=lambda work: ["export", "dense-test/dense-9-00000", "--format", "usd", "--out", work.out],
        says=("dense-9-00000",),
    ),
    Case(name="scene-is-a-file", make=is_file, says=("scene.json",)),
    Case(name="damaged-scene", make=damaged_scene, says=("scene.json", "goal_pairs")),
    Case(name="a-file-where-the-folder-should-be", make=file_in_the_way, says=("notes.txt is in the way",)),
    Case(
        name="generate-to-unknown-format",
        make=lambda work: ["generate", "--track", "sparse", "--out", work.out, "--export", "obj"],
        says=("unknown export format 'obj'", "known: glb, mjcf, usd, usdz"),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


def test_a_folder_where_the_file_should_be_is_named(workspace: Workspace) -> None:
    check_refusal(run_command(folder_in_the_way(workspace)), 2, ("scene.glb is in the way",))


@pytest.mark.parametrize("name", ["mjcf", "usd", "usdz", "glb"])
def test_a_place_that_cannot_be_written_is_named(name: str, workspace: Workspace) -> None:
    outcome = run_command(export(workspace, scene="scenes/boxes-0", formats=name, out="/proc/1/exported"))
    check_refusal(outcome, 1, ("/proc/1/exported", "nothing earlier was changed"))


def small_files_only() -> None:
    """In a child, before it starts: the kernel refuses to let a file grow beyond 4 KiB."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))


@pytest.mark.parametrize("name", ["mjcf", "usd", "usdz", "glb"])
def test_a_full_disk_is_one_line_and_leaves_what_was_there(name: str, workspace: Workspace) -> None:
    arguments = export(workspace, scene="scenes/boxes-0", formats=name)
    assert run_command(arguments).code == 0
    before = fingerprint(workspace.path)
    check_refusal(
        run_process(arguments, preexec_fn=small_files_only), 1, ("cannot write", "nothing earlier was changed")
    )
    assert fingerprint(workspace.path) == before
