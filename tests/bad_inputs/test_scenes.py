"""Scene sets that are damaged, tampered with or of another kind; met by ``evaluate``, ``render`` and ``generate``."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

SCENE = "scenes/boxes-0/scene.json"


def evaluate(work: Workspace) -> Sequence[str]:
    return ["evaluate", "--policy", "zero", "--scenes", str(work.scenes), "--out", work.out, "--max-steps", "3"]


def render(work: Workspace) -> Sequence[str]:
    return ["render", str(work.scenes), "--out", work.out, "--backend", "raycast", "--limit", "1"]


def spoiled(change: Callable[[Path], object], command: Callable[[Workspace], Sequence[str]] = evaluate):
    """Change the folder of scenes; then use it."""

    def make(work: Workspace) -> Sequence[str]:
        change(work.scenes)
        return command(work)

    return make


def edited(change: Callable[[Any], object], file: str = SCENE) -> Callable[[Workspace], Sequence[str]]:
    def edit(folder: Path) -> None:
        content = json.loads((folder / file).read_text())
        change(content)
        (folder / file).write_text(json.dumps(content))

    return spoiled(edit)


def text_of(content: str | bytes, file: str = SCENE) -> Callable[[Workspace], Sequence[str]]:
    data = content.encode() if isinstance(content, str) else content
    return spoiled(lambda folder: (folder / file).write_bytes(data))


def cut(file: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        path = folder / file
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])

    return change


def huge(folder: Path) -> None:
    with (folder / SCENE).open("r+b") as file:
        file.truncate(80 << 20)


def folder_for_a_file(folder: Path) -> None:
    path = folder / SCENE
    path.unlink()
    path.mkdir()


def asset_missing(folder: Path) -> None:
    shutil.rmtree(next((folder / "library" / "assets").glob("small_0-0-*")))


def asset_tampered(folder: Path) -> None:
    path = next((folder / "library" / "assets").glob("target-0-*")) / "asset.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "mass_kg": 9.0}))


def pair(**changed: Any) -> Callable[[Any], object]:
    return lambda scene: scene["goal_pairs"][1].update(changed)


def first_object(**changed: Any) -> Callable[[Any], object]:
    return lambda scene: scene["objects"][0].update(changed)


TILTED = {"position": [0.0, 0.0, 0.1], "quat_wxyz": [1.0, 0.1, 0.0, 0.0]}

CASES = [
    Case(name="scene-truncated", make=spoiled(cut(SCENE)), says=("scene.json", "not a valid scene file")),
    Case(name="scene-empty", make=text_of(""), says=("scene.json", "not a valid scene file")),
    Case(name="scene-in-latin-1", make=text_of(b'{"scene_id": "\xe9\xff"}'), says=("scene.json", "not a valid")),
    Case(name="scene-is-a-list", make=text_of("[]"), says=("scene.json", "not a valid scene file")),
    Case(name="scene-nested-too-deeply", make=text_of("[" * 100_000), says=("scene.json", "recursion")),
    Case(name="scene-of-eighty-megabytes", make=spoiled(huge), says=("scene.json", "83,886,080 bytes", "allowed")),
    Case(name="scene-a-folder", make=spoiled(folder_for_a_file), says=("scene.json", "directory")),
    Case(
        name="scene-with-unknown-field", make=edited(lambda it: it.update(colour="red")), says=("scene.json", "colour")
    ),
    Case(
        name="scene-without-goal-pairs",
        make=edited(lambda it: it.update(goal_pairs=[])),
        says=("scene.json", "goal_pairs"),
    ),
    Case(
        name="scene-of-a-later-schema",
        make=edited(lambda it: it.update(schema_version=3)),
        says=("scene.json", "schema_version"),
    ),
    Case(
        name="scene-of-another-track",
        make=edited(lambda it: it.update(track="dense")),
        says=("scene.json", "track dense"),
    ),
    Case(
        name="scene-with-anothers-name",
        make=edited(lambda it: it.update(scene_id="boxes-1")),
        says=("scene.json", "boxes-1", "out of place"),
    ),
    Case(
        name="scene-id-leaves-the-folder",
        make=edited(lambda it: it.update(scene_id="../../evil")),
        says=("scene.json", "scene_id"),
    ),
    Case(name="goal-not-unit", make=edited(pair(goal=TILTED)), says=("scene.json", "goal_pairs.1.goal", "not unit")),
    Case(
        name="goal-nan",
        make=text_of(
            '{"schema_version": 1, "goal_pairs": [{"goal": {"position": [NaN, 0, 0], "quat_wxyz": [1, 0, 0, 0]}}]}'
        ),
        says=("scene.json",),
    ),
    Case(
        name="pose-nan",
        make=edited(lambda it: it["goal_pairs"][0]["object_poses"][1].__setitem__(2, float("nan"))),
        says=("scene.json", "object_poses.1.2"),
    ),
    Case(
        name="pose-infinite",
        make=edited(lambda it: it["goal_pairs"][0]["object_poses"][1].__setitem__(0, float("inf"))),
        says=("scene.json", "object_poses.1.0"),
    ),
    Case(
        name="pose-missing",
        make=edited(lambda it: it["goal_pairs"][0]["object_poses"].pop()),
        says=("scene.json", "4 objects"),
    ),
    Case(name="pose-in-words", make=edited(pair(object_poses="here")), says=("scene.json", "object_poses")),
    Case(
        name="two-targets",
        make=edited(lambda it: it["objects"][1].update(role="target")),
        says=("scene.json", "only it, must have the role 'target'"),
    ),
    Case(
        name="two-of-one-name",
        make=edited(lambda it: it["objects"][1].update(name="target")),
        says=("scene.json", "unique"),
    ),
    Case(
        name="relation-of-a-stranger",
        make=edited(lambda it: it["relations"][0].update(subject="ghost")),
        says=("scene.json", "'ghost'"),
    ),
    Case(
        name="asset-hash-of-nothing",
        make=edited(first_object(asset_hash="0" * 64)),
        says=("library", "boxes-0", "target-0", "is missing"),
    ),
    Case(name="asset-hash-in-words", make=edited(first_object(asset_hash="best")), says=("scene.json", "asset_hash")),
    Case(
        name="stable-pose-that-is-not-there",
        make=edited(first_object(stable_index=99)),
        says=("boxes-0", "99"),
    ),
    Case(name="asset-missing", make=spoiled(asset_missing), says=("library", "small_0-0", "is missing")),
    Case(
        name="asset-missing-when-drawn",
        make=spoiled(asset_missing, render),
        says=("library", "small_0-0", "is missing"),
    ),
    Case(name="asset-tampered", make=spoiled(asset_tampered), says=("target-0", "content has hash")),
    Case(name="asset-tampered-when-drawn", make=spoiled(asset_tampered, render), says=("target-0", "content has hash")),
    Case(
        name="library-missing",
        make=spoiled(lambda folder: shutil.rmtree(folder / "library")),
        says=("asset library not found", "library"),
    ),
    Case(
        name="header-truncated",
        make=spoiled(cut("scene_set.json")),
        says=("scene_set.json", "not a valid scene set"),
    ),
    Case(
        name="header-of-a-later-schema",
        make=edited(lambda it: it.update(schema_version=2), "scene_set.json"),
        says=("scene_set.json", "schema_version"),
    ),
    Case(
        name="header-of-an-unknown-track",
        make=edited(lambda it: it.update(track="cosy"), "scene_set.json"),
        says=("scene.json", "track sparse"),
    ),
    Case(
        name="header-of-something-else",
        make=edited(lambda it: it.update(format="photos"), "scene_set.json"),
        says=("scene_set.json", "format"),
    ),
    Case(
        name="no-scene-in-the-set",
        make=spoiled(lambda folder: shutil.rmtree(folder / "scenes")),
        says=("scenes", "holds no scenes", "generation"),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_damaged_scene_set_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert before.items() <= fingerprint(workspace.path).items()
