"""Mistakes with the review of a library: one line, and nothing touched."""

import socket

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def review(work: Workspace, *options: str) -> list[str]:
    return ["assets", "review", str(work.library), "--no-browser", *options]


def with_journal(content: bytes, *command: str):
    def make(work: Workspace) -> list[str]:
        (work.library / "reviews.jsonl").write_bytes(content)
        library = ["--library"] if command[1] in ("list", "verify") else []
        return [*command, *library, str(work.library)]

    return make


def journal_is_a_folder(work: Workspace) -> list[str]:
    (work.library / "reviews.jsonl").mkdir()
    return review(work)


def journal_is_a_link(work: Workspace) -> list[str]:
    (work.library / "reviews.jsonl").symlink_to(work.path / "elsewhere.jsonl")
    return review(work)


def damaged_asset(work: Workspace) -> list[str]:
    next((work.library / "assets").iterdir()).joinpath("asset.json").write_text("{")
    return review(work)


CASES = [
    Case(
        name="no-library",
        make=lambda work: ["assets", "review", str(work.path / "none")],
        says=("asset library not found", "none", "make one with"),
    ),
    Case(
        name="a-library-by-name",
        make=lambda work: ["assets", "review", "procedural"],
        says=("asset library not found", "procedural"),
    ),
    Case(name="port-too-high", make=lambda work: review(work, "--port", "65536"), says=("--port", "65535")),
    Case(name="port-is-a-word", make=lambda work: review(work, "--port", "http"), says=("--port", "integer")),
    Case(name="reviewer-is-blank", make=lambda work: review(work, "--reviewer", "  "), says=("--reviewer",)),
    Case(name="reviewer-breaks-lines", make=lambda work: review(work, "--reviewer", "a\nb"), says=("--reviewer",)),
    Case(
        name="journal-is-prose",
        make=with_journal(b"mug: fine\n", "assets", "reviews"),
        says=("reviews.jsonl", "line 1 is no review"),
    ),
    Case(
        name="journal-of-a-later-schema",
        make=with_journal(b'{"schema_version": 2}\n', "assets", "list"),
        says=("reviews.jsonl", "line 1", "schema_version"),
    ),
    Case(
        name="journal-is-prose-when-reviewing",
        make=with_journal(b"\0\0\0\n", "assets", "review", "--no-browser"),
        says=("reviews.jsonl", "line 1"),
    ),
    Case(name="journal-is-a-folder", make=journal_is_a_folder, says=("reviews.jsonl", "Is a directory"), code=1),
    Case(name="journal-is-a-link", make=journal_is_a_link, says=("reviews.jsonl", "symbolic links"), code=1),
    Case(name="asset-damaged", make=damaged_asset, says=("asset.json", "not a valid asset")),
    Case(
        name="export-into-a-folder",
        make=lambda work: ["assets", "reviews", str(work.library), "--csv", str(work.library)],
        says=("in the way",),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_refused_and_no_asset_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.library / "assets")
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.library / "assets") == before


def test_a_taken_port_is_named(workspace: Workspace) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        check_refusal(run_command(review(workspace, "--port", str(port))), 2, (f"--port {port}", "choose another"))
