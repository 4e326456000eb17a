"""Annotating with an endpoint, a model or a library that is not there."""

import json
import socket
from collections.abc import Callable, Sequence

import pytest

from clutter6d.assets.annotation.plan import ATTRIBUTES
from clutter6d.assets.asset_file import JSON_NAME, read_asset, write_asset
from clutter6d.assets.attribute_change import AttributeChange, changed_asset
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

NOBODY = "http://127.0.0.1:9/v1"


@pytest.fixture(autouse=True)
def _no_endpoint_of_the_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("OPENAI_API_KEY", "OPENAI_BASE_URL", "CLUTTER6D_VLM_MODEL"):
        monkeypatch.delenv(name, raising=False)


def annotate(*options: str) -> Callable[[Workspace], Sequence[str]]:
    return lambda work: ["assets", "annotate", str(work.library), *options]


def by_model(*options: str) -> Callable[[Workspace], Sequence[str]]:
    """With an address and a model that would do, of values that may be replaced."""
    given = {"--by": "vlm", "--base-url": NOBODY, "--model": "m", "--retries": "0", "--overwrite": "declared"}
    given |= dict(zip(options[::2], options[1::2], strict=True))
    return annotate(*(word for pair in given.items() for word in pair))


def unused_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def damaged_journal(work: Workspace) -> Sequence[str]:
    (work.library / "library.json").write_text(json.dumps({"format": "other"}))
    return annotate()(work)


CASES = [
    Case(
        name="library-not-there",
        make=lambda work: ["assets", "annotate", str(work.path / "nowhere")],
        says=("asset library not found", "nowhere", "clutter6d assets process"),
    ),
    Case(
        name="library-is-a-scene-set",
        make=lambda work: ["assets", "annotate", str(work.scenes)],
        says=("asset library not found", "scenes"),
    ),
    Case(name="library-damaged", make=damaged_journal, says=("library.json", "not a valid asset library")),
    Case(
        name="unknown-annotator",
        make=annotate("--by", "vml"),
        says=("unknown annotator 'vml'", "did you mean 'vlm'?", "rule"),
    ),
    Case(
        name="no-endpoint-and-no-key",
        make=annotate("--by", "vlm", "--model", "m"),
        says=("no endpoint", "--base-url", "OPENAI_BASE_URL", "OPENAI_API_KEY"),
    ),
    Case(
        name="no-model",
        make=annotate("--by", "vlm", "--base-url", NOBODY),
        says=("no model", "--model", "CLUTTER6D_VLM_MODEL"),
    ),
    Case(
        name="address-without-a-scheme",
        make=by_model("--base-url", "localhost:8000"),
        says=("--base-url 'localhost:8000' is no address", "http://127.0.0.1:8000/v1"),
    ),
    Case(name="address-of-a-file", make=by_model("--base-url", "file:///etc/passwd"), says=("is no address",)),
    Case(
        name="address-with-a-port-in-words",
        make=by_model("--base-url", "http://localhost:http/v1"),
        says=("is no address",),
    ),
    Case(
        name="nobody-at-the-address",
        make=lambda work: by_model("--base-url", f"http://127.0.0.1:{unused_port()}/v1")(work),
        says=("the endpoint failed, unreachable", "http://127.0.0.1:", "check --base-url", "same command again"),
    ),
    Case(
        name="unknown-origin",
        make=annotate("--overwrite", "people"),
        says=("unknown origin 'people'", "person", "vlm"),
    ),
    Case(name="no-questions-at-a-time", make=annotate("--concurrency", "0"), says=("--concurrency", "1")),
    Case(name="a-negative-price", make=annotate("--price-in", "-1"), says=("--price-in", "0")),
    Case(
        name="unknown-renderer",
        make=by_model("--backend", "vulkan"),
        says=("unknown rendering backend 'vulkan'", "raycast"),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_it_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


def test_a_damaged_asset_is_reported_and_the_others_are_annotated(workspace: Workspace) -> None:
    first, *others = sorted((workspace.library / "assets").iterdir())
    (first / JSON_NAME).write_text("{}")
    outcome = run_command(["assets", "annotate", str(workspace.library), "--overwrite", "declared"])
    assert outcome.code == 0, outcome.err
    assert f"{len(others)} of {len(others) + 1} assets annotated" in outcome.out
    assert "failed: cannot-be-read" in outcome.out


def test_an_asset_whose_every_value_is_a_persons_stays(workspace: Workspace) -> None:
    folder = sorted((workspace.library / "assets").iterdir())[0]
    asset = read_asset(folder)
    values = {name: getattr(asset.attributes, name) for name in ATTRIBUTES if name != "mass_kg"}
    mine = changed_asset(asset, AttributeChange(**values, mass_kg=0.5), by="person")
    write_asset(folder.with_name(f"{mine.name}-{mine.content_hash[:12]}"), mine)
    (folder / JSON_NAME).unlink()
    assert run_command(["assets", "annotate", str(workspace.library), "--overwrite", "declared"]).code == 0
    assert (folder.with_name(f"{mine.name}-{mine.content_hash[:12]}") / JSON_NAME).exists()
