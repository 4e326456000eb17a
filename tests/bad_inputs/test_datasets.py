"""Data sets that are unknown, damaged or tampered with, and recipes that cannot be followed."""

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from clutter6d.dataset.dataset import open_dataset
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command

RECIPE = {
    "name": "mine",
    "title": "Mine",
    "licence": "CC0",
    "ships_assets": True,
    "pools": {"test": {"source": "procedural", "options": {"seed": 1, "count": 6}}},
    "splits": [{"name": "sparse-test", "track": "sparse", "pool": "test", "seed": 1, "scenes": 1}],
}


def verify(folder: Path, *options: str) -> Sequence[str]:
    return ["dataset", "verify", str(folder), *options]


def copied(change: Callable[[Path], object], *options: str) -> Callable[[Workspace], Sequence[str]]:
    """Spoil a copy of Clutter6D v1, without its assets' 20 MB where they are not read; then verify it."""

    def make(work: Workspace) -> Sequence[str]:
        folder = work.path / "clutter6d-v1"
        shutil.copytree(open_dataset("clutter6d-v1").path, folder)
        change(folder)
        return verify(folder, *options)

    return make


def manifest(change: Callable[[Any], object]) -> Callable[[Path], object]:
    def edit(folder: Path) -> None:
        content = json.loads((folder / "manifest.json").read_text())
        change(content)
        (folder / "manifest.json").write_text(json.dumps(content))

    return edit


def cut(name: str) -> Callable[[Path], object]:
    def change(folder: Path) -> None:
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: len(content) // 2])

    return change


def swap_splits(folder: Path) -> None:
    shutil.copy(folder / "sparse-test.parquet", folder / "dense-test.parquet")


def recipe(options: Sequence[str] = (), **changes: Any) -> Callable[[Workspace], Sequence[str]]:
    def make(work: Workspace) -> Sequence[str]:
        path = work.path / "recipe.json"
        path.write_text(json.dumps({**RECIPE, **changes}))
        return ["dataset", "freeze", str(path), "--work", str(work.path / "work"), "--out", work.out, *options]

    return make


def split(**changes: Any) -> list[dict[str, Any]]:
    return [{**RECIPE["splits"][0], **changes}]


def pool(**changes: Any) -> dict[str, Any]:
    return {"test": {**RECIPE["pools"]["test"], **changes}}


def frozen_already(work: Workspace) -> Sequence[str]:
    Path(work.out).mkdir()
    shutil.copy(open_dataset("clutter6d-v1").path / "manifest.json", work.out)
    return recipe()(work)


def evaluate_split(name: str) -> Callable[[Workspace], Sequence[str]]:
    return lambda work: ["evaluate", "--policy", "zero", "--scenes", name, "--out", work.out]


CASES = [
    Case(
        name="data-set-unknown", make=lambda _: ["dataset", "verify", "clutter6d-v9"], says=("clutter6d-v9", "did you")
    ),
    Case(name="data-set-is-a-path", make=lambda _: ["dataset", "info", "../../etc"], says=("unknown data set",)),
    Case(name="split-unknown", make=evaluate_split("dense-tset"), says=("dense-tset", "did you mean 'dense-test'")),
    Case(name="split-of-unknown-set", make=evaluate_split("other/dense-test"), says=("other/dense-test",)),
    Case(
        name="scene-of-split-unknown",
        make=lambda work: ["render", "dense-test/dense-2-0001", "--out", work.out],
        says=("dense-2-0001",),
    ),
    Case(
        name="split-of-verify-unknown",
        make=lambda _: ["dataset", "verify", "clutter6d-v1", "--split", "none"],
        says=("unknown split of clutter6d-v1", "none"),
    ),
    Case(
        name="manifest-not-json",
        make=copied(lambda folder: (folder / "manifest.json").write_text("{")),
        says=("manifest.json", "not a valid data set manifest"),
    ),
    Case(
        name="manifest-of-the-future",
        make=copied(manifest(lambda m: m.update(schema_version=2))),
        says=("manifest.json", "schema_version"),
    ),
    Case(
        name="manifest-leaves-its-folder",
        make=copied(manifest(lambda m: m["splits"][0].update(file="../../sparse.parquet"))),
        says=("manifest.json", "splits.0.file"),
    ),
    Case(
        name="split-cut-off",
        make=copied(cut("dense-test.parquet")),
        says=("dense-test.parquet", "not a valid split file"),
    ),
    Case(name="split-exchanged", make=copied(swap_splits), says=("dense-test.parquet", "SHA-256")),
    Case(name="assets-cut-off", make=copied(cut("assets.parquet")), says=("assets.parquet", "not a valid asset pack")),
    Case(
        name="asset-list-changed",
        make=copied(lambda folder: (folder / "asset_list.csv").write_text("name\n")),
        says=("asset_list.csv", "SHA-256"),
    ),
    Case(
        name="split-file-missing",
        make=copied(lambda folder: (folder / "moderate-test.parquet").unlink()),
        says=("moderate-test.parquet",),
    ),
    Case(
        name="engine-of-another-version",
        make=copied(manifest(lambda m: m.update(engine="mujoco 9.9.9")), "--regenerate", "1"),
        says=("mujoco 9.9.9", "install that"),
    ),
    Case(
        name="no-workers", make=lambda _: ["dataset", "verify", "clutter6d-v1", "--workers", "0"], says=("--workers",)
    ),
    Case(
        name="recipe-missing",
        make=lambda work: ["dataset", "freeze", str(work.path / "no.json"), "--work", work.out],
        says=("no.json",),
    ),
    Case(name="recipe-with-unknown-field", make=recipe(colour="red"), says=("recipe.json", "colour")),
    Case(name="recipe-without-splits", make=recipe(splits=[]), says=("recipe.json", "splits")),
    Case(name="recipe-name-leaves-folder", make=recipe(splits=split(name="../x")), says=("recipe.json", "name")),
    Case(name="recipe-pool-unknown", make=recipe(splits=split(pool="none")), says=("pool 'none'",)),
    Case(name="recipe-track-unknown", make=recipe(splits=split(track="crowded")), says=("crowded",)),
    Case(name="recipe-source-unknown", make=recipe(pools=pool(source="nowhere")), says=("nowhere",)),
    Case(name="recipe-source-option-unknown", make=recipe(pools=pool(options={"colour": 1})), says=("colour",)),
    Case(name="pool-option-without-folder", make=recipe(["--pool", "test"]), says=("--pool test", "POOL=LIBRARY")),
    Case(name="pool-library-missing", make=recipe(["--pool", "test=nowhere"]), says=("nowhere",)),
    Case(name="frozen-already", make=frozen_already, says=("frozen data set", "new version")),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_mistake_is_one_clear_line_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert before.items() <= fingerprint(workspace.path).items()
