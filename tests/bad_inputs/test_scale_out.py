"""Executors that are not there, and plans of nothing."""

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def on(executor: str, *command: str):
    return lambda work: [*(word.format(work=work) for word in command), "--executor", executor]


PROCESS = ("assets", "process", "procedural", "--limit", "1", "--out", "{work.path}/out")
GENERATE = ("generate", "--track", "sparse", "--library", "{work.library}", "--out", "{work.path}/out")
EVALUATE = ("evaluate", "--policy", "zero", "--scenes", "{work.scenes}", "--out", "{work.path}/out")

CASES = [
    Case(name="unknown-executor", make=on("rya", *PROCESS), says=("unknown executor 'rya'", "did you mean 'ray'")),
    Case(name="executor-without-port", make=on("ray:head", *GENERATE), says=("'ray:head'", "HOST:PORT")),
    Case(name="local-with-an-address", make=on("local:4", *EVALUATE), says=("'local:4'", "no address")),
    Case(
        name="estimate-of-an-unknown-track",
        make=lambda work: ["estimate", "--track", "crowded"],
        says=("unknown track 'crowded'",),
    ),
    Case(
        name="estimate-of-an-unknown-source",
        make=lambda work: ["estimate", "--source", "procedral", "--scenes", "0"],
        says=("unknown asset source 'procedral'", "did you mean 'procedural'"),
    ),
    Case(
        name="estimate-from-nothing",
        make=lambda work: ["estimate", "--source", empty_folder(work), "--scenes", "0"],
        says=("none of 1 sampled objects", "the file is empty"),
    ),
]


def empty_folder(work: Workspace) -> str:
    (work.path / "empty-meshes").mkdir()
    (work.path / "empty-meshes" / "bad.obj").write_bytes(b"")
    return str(work.path / "empty-meshes")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


@pytest.mark.parametrize("command", [GENERATE, EVALUATE], ids=["generate", "evaluate"])
def test_a_cluster_that_does_not_answer_is_one_line(command: tuple[str, ...], workspace: Workspace) -> None:
    pytest.importorskip("ray", reason='needs pip install "clutter6d[ray]"')
    outcome = run_command(on("ray:127.0.0.1:1", *command)(workspace))
    assert outcome.code == 2
    assert "127.0.0.1:1" in outcome.err or "CoACD" in outcome.err
    assert len(outcome.err.splitlines()) == 1
