"""Things that cannot be played."""

import socket
from collections.abc import Iterator, Sequence

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def playing(*arguments: str):
    """The zero policy on the workspace's scenes, with further arguments."""

    def make(work: Workspace) -> Sequence[str]:
        return ["play", "--policy", "zero", "--scenes", str(work.scenes), "--viewer", "web", "--no-browser", *arguments]

    return make


def looking_through(*arguments: str, spoil=lambda work: None):
    """The workspace's evaluation, after something was done to it."""

    def make(work: Workspace) -> Sequence[str]:
        spoil(work)
        return ["play", str(work.results), "--viewer", "web", "--no-browser", *arguments]

    return make


def cut(name: str):
    def spoil(work: Workspace) -> None:
        path = work.results / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return spoil


def unfinished(work: Workspace) -> None:
    (work.results / "report.json").unlink()


CASES = [
    Case(name="nothing", make=lambda work: ["play"], says=("--policy", "evaluation")),
    Case(name="both", make=looking_through("--policy", "zero"), says=("either", "--policy")),
    Case(
        name="no-such-policy",
        make=lambda work: ["play", "--policy", "zeros", "--scenes", str(work.scenes)],
        says=("did you mean 'zero'?",),
    ),
    Case(
        name="no-such-scenes", make=lambda work: ["play", "--policy", "zero", "--scenes", "dens-test"],
        says=("did you mean 'dense-test'?",),
    ),
    Case(name="no-such-scene", make=playing("--scene", "boxes-7"), says=("unknown scene 'boxes-7'", "boxes-0")),
    Case(name="no-such-pair", make=playing("--pair", "2"), says=("boxes-0", "goal pairs 0 to 1, not 2")),
    Case(name="negative-pair", make=playing("--pair", "-1"), says=("--pair",)),
    Case(name="no-such-viewer", make=playing("--viewer", "wob"), says=("did you mean 'web'?",)),
    Case(name="a-port-beyond-all", make=playing("--port", "70000"), says=("--port",)),
    Case(name="somebody-elses-address", make=playing("--host", "203.0.113.7"), says=("--host 203.0.113.7",)),
    Case(name="no-address", make=playing("--host", "no such host"), says=("--host no such host",)),
    Case(
        name="no-such-evaluation", make=lambda work: ["play", str(work.path / "nothing")],
        says=("finished evaluation not found", "clutter6d evaluate"),
    ),
    Case(
        name="an-unfinished-evaluation", make=looking_through(spoil=unfinished),
        says=("finished evaluation not found", "clutter6d evaluate"),
    ),
    Case(name="half-a-report", make=looking_through(spoil=cut("report.json")), says=("report.json",)),
    Case(name="half-the-actions", make=looking_through(spoil=cut("actions.parquet")), says=("actions.parquet",)),
    Case(name="half-the-episodes", make=looking_through(spoil=cut("episodes.parquet")), says=("episodes.parquet",)),
    Case(
        name="other-scenes", make=looking_through("--scenes", "sparse-test"),
        says=("not the scenes of the evaluation", "--scenes"),
    ),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_cannot_be_played_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


@pytest.fixture
def taken_port() -> Iterator[int]:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        yield taken.getsockname()[1]


def test_a_port_that_is_taken_is_refused(taken_port: int, workspace: Workspace) -> None:
    outcome = run_command(playing("--port", str(taken_port))(workspace))
    check_refusal(outcome, 2, (f"--port {taken_port}", "in use"))


def test_a_policy_that_fails_while_it_is_watched_is_blamed(
    workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    from clutter6d.play.web_view import WebView

    monkeypatch.setattr(WebView, "is_watched", property(lambda self: True))
    arguments = list(playing()(workspace))
    arguments[2] = "tests.bad_inputs.policies:fails_to_act"
    check_refusal(run_command(arguments), 2, ("policy 'wrong' failed", "division by zero"))
