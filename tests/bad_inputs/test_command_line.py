"""Options that name nothing, or promise what cannot be."""

import json
from collections.abc import Sequence

import pytest

from tests.bad_inputs.boxes import gltf, obj
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command
from tests.scene_fixtures import write_box_scene_set


def generate(work: Workspace, **changed: str) -> list[str]:
    options = {"track": "sparse", "scenes": "1", "library": str(work.library), "out": work.out} | changed
    return ["generate", *(word for name, value in options.items() for word in (f"--{name}", value))]


def evaluate(work: Workspace, **changed: str) -> list[str]:
    options = {"policy": "zero", "scenes": str(work.scenes), "out": work.out, "max-steps": "3"} | changed
    return ["evaluate", *(word for name, value in options.items() for word in (f"--{name}", value))]


def out_is_a_file(work: Workspace) -> str:
    (work.path / "out").write_text("my notes")
    return work.out


def out_holds_other_things(work: Workspace) -> str:
    (work.path / "out").mkdir()
    (work.path / "out" / "thesis.tex").write_text("mine")
    return work.out


def generate_into_a_file(work: Workspace) -> Sequence[str]:
    return generate(work, out=out_is_a_file(work))


def generate_below_a_file(work: Workspace) -> Sequence[str]:
    return generate(work, out=out_is_a_file(work) + "/scenes", library=str(work.scenes / "library"))


def evaluate_into_a_file(work: Workspace) -> Sequence[str]:
    return evaluate(work, out=out_is_a_file(work))


def render_into_a_file(work: Workspace) -> Sequence[str]:
    return [
        "render",
        str(work.scenes),
        "--out",
        out_is_a_file(work),
        "--backend",
        "raycast",
        "--width",
        "64",
        "--height",
        "48",
    ]


def continue_a_later_schema(work: Workspace) -> Sequence[str]:
    path = work.results / "run.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "schema_version": 2}))
    return evaluate(work, out=str(work.results))


def render_an_empty_folder(work: Workspace) -> Sequence[str]:
    (work.path / "empty").mkdir()
    return ["render", str(work.path / "empty")]


CASES = [
    Case(name="no-such-command", make=lambda work: ["genrate"], says=("genrate", "generate")),
    Case(name="no-such-option", make=lambda work: ["generate", "--trak", "sparse"], says=("--trak",)),
    Case(name="option-missing", make=lambda work: ["generate", "--out", work.out], says=("--track",)),
    Case(
        name="unknown-track",
        make=lambda work: generate(work, track="dens"),
        says=("unknown track 'dens'", "did you mean 'dense'?", "sparse"),
    ),
    Case(name="no-scenes", make=lambda work: generate(work, scenes="0"), says=("--scenes", "1")),
    Case(name="scenes-in-words", make=lambda work: generate(work, scenes="many"), says=("--scenes", "integer")),
    Case(name="negative-first", make=lambda work: generate(work, first="-3"), says=("--first", "0")),
    Case(name="negative-workers", make=lambda work: generate(work, workers="-1"), says=("--workers", "1")),
    Case(
        name="unknown-export",
        make=lambda work: generate(work, export="mjcf,stp"),
        says=("export format", "'stp'", "mjcf"),
    ),
    Case(
        name="unknown-library",
        make=lambda work: generate(work, library="procedual"),
        says=("library", "procedual", "did you mean 'procedural'?"),
    ),
    Case(
        name="library-too-small-for-the-track",
        make=lambda work: generate(work, track="dense"),
        says=("large", "2"),
    ),
    Case(
        name="generate-into-a-file", make=generate_into_a_file, says=("scene_set.json", "the file", "out is in the way")
    ),
    Case(name="generate-below-a-file", make=generate_below_a_file, says=("out is in the way", "choose another place")),
    Case(
        name="generate-over-other-things",
        make=lambda work: generate(work, out=out_holds_other_things(work)),
        says=("out", "choose another --out"),
    ),
    Case(
        name="generate-over-another-seed",
        make=lambda work: generate(work, out=str(work.scenes), seed="7"),
        says=("scenes", "seed", "choose another --out"),
    ),
    Case(name="evaluate-no-pairs", make=lambda work: evaluate(work, pairs="0"), says=("--pairs", "1")),
    Case(
        name="evaluate-more-pairs-than-there-are",
        make=lambda work: evaluate(work, pairs="99"),
        says=("pairs is 99", "at most 2"),
    ),
    Case(name="no-environments", make=lambda work: evaluate(work, **{"num-envs": "0"}), says=("--num-envs", "1")),
    Case(name="negative-threads", make=lambda work: evaluate(work, threads="-2"), says=("--threads", "0")),
    Case(
        name="evaluate-scenes-that-are-not-there",
        make=lambda work: evaluate(work, scenes=str(work.path / "nowhere")),
        says=("scene set not found", "nowhere", "clutter6d generate"),
    ),
    Case(
        name="evaluate-an-asset-library",
        make=lambda work: evaluate(work, scenes=str(work.library)),
        says=("scene set not found", "library"),
    ),
    Case(name="evaluate-into-a-file", make=evaluate_into_a_file, says=("out", "choose another --out")),
    Case(
        name="evaluate-over-other-things",
        make=lambda work: evaluate(work, out=out_holds_other_things(work)),
        says=("out", "choose another --out"),
    ),
    Case(
        name="continue-with-another-seed",
        make=lambda work: evaluate(work, out=str(work.results), seed="1"),
        says=("results", "seed was 0, is 1", "choose another --out"),
    ),
    Case(
        name="continue-with-another-policy",
        make=lambda work: evaluate(work, out=str(work.results), policy="random"),
        says=("results", "policy was zero, is random"),
    ),
    Case(name="continue-what-a-later-version-began", make=continue_a_later_schema, says=("run.json", "schema_version")),
    Case(
        name="render-an-empty-folder",
        make=render_an_empty_folder,
        says=("scene set not found", "empty", "clutter6d generate"),
    ),
    Case(
        name="unknown-backend",
        make=lambda work: ["render", str(work.scenes), "--backend", "vulkan"],
        says=("unknown rendering backend 'vulkan'", "egl"),
    ),
    Case(
        name="pair-that-is-not-there",
        make=lambda work: ["render", str(work.scenes), "--backend", "raycast", "--pair", "9"],
        says=("boxes-0", "9"),
    ),
    Case(
        name="picture-without-pixels",
        make=lambda work: ["render", str(work.scenes), "--backend", "raycast", "--width", "0"],
        says=("0 x 720 pixels", "positive"),
    ),
    Case(
        name="picture-of-an-acre",
        make=lambda work: ["render", str(work.scenes), "--backend", "raycast", "--width", "4000000"],
        says=("4000000 x 720 pixels", "16,777,216"),
    ),
    Case(name="render-into-a-file", make=render_into_a_file, says=("out is in the way",)),
    Case(
        name="replay-nothing",
        make=lambda work: ["replay", str(work.path / "nowhere")],
        says=("evaluation not found", "nowhere", "clutter6d evaluate"),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_wrong_command_is_refused_and_touches_nothing(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


def test_names_that_look_like_markup_are_shown_as_they_are(tmp_path) -> None:
    odd = tmp_path / "scenes [draft" / "b] :mug:"
    scenes, out = write_box_scene_set(odd / "scenes").path, odd / "out"
    (odd / "meshes").mkdir()
    (odd / "meshes" / "[red]box.obj").write_bytes(obj())
    (odd / "meshes" / "bad.gltf").write_bytes(gltf("[/red].bin"))
    library = ["--library", str(odd / "library")]
    for command in (
        ["assets", "process", str(odd / "meshes"), *library, "--author", "[/me]", "--licence", "[/cc] :mug:"],
        ["assets", "list", *library],
        ["assets", "show", "red-box", *library],
        ["assets", "verify", *library],
        ["evaluate", "--policy", "zero", "--scenes", str(scenes), "--out", str(out), "--max-steps", "2"],
        ["replay", str(out)],
        ["render", str(scenes), "--backend", "raycast", "--width", "64", "--height", "48"],
    ):
        outcome = run_command(command)
        assert (outcome.code, outcome.err) == (0, ""), command
        if command[1] == "show":
            assert "[/me]" in outcome.out
            assert "[/cc] :mug:" in outcome.out
