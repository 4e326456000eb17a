"""Recordings that cannot be made, and recorded rollouts that are damaged."""

import json
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from clutter6d.errors import InvalidFileError, MissingFileError
from clutter6d.recording import read_rollouts
from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def record(*options: str) -> Callable[[Workspace], Sequence[str]]:
    """Record the good evaluation with an option that is wrong."""
    return lambda work: ["record", str(work.results), "--format", "parquet", "--out", work.out, *options]


def record_policy(*options: str) -> Callable[[Workspace], Sequence[str]]:
    """Record a policy with an option that is wrong."""
    fixed = ["--max-steps", "2", "--threads", "1"]
    return lambda work: ["record", "--scenes", str(work.scenes), "--out", work.out, *fixed, *options]


def spoiled(file: str, change: Callable[[bytes], bytes]) -> Callable[[Workspace], Sequence[str]]:
    """Record an evaluation one of whose files is changed."""

    def make(work: Workspace) -> Sequence[str]:
        path = work.results / file
        path.write_bytes(change(path.read_bytes()))
        return record()(work)

    return make


def flipped_actions(work: Workspace) -> Sequence[str]:
    frame = pd.read_parquet(work.results / "actions.parquet")
    frame["action_1"] = np.float32(0.07)
    frame.to_parquet(work.results / "actions.parquet", index=False)
    return record()(work)


def another_split(work: Workspace) -> Sequence[str]:
    return record("--scenes", "sparse-test")(work)


def other_settings(work: Workspace) -> Sequence[str]:
    assert run_command(record("--episodes", "1")(work)).code == 0
    return record("--episodes", "1", "--point-clouds")(work)


def other_seed(work: Workspace) -> Sequence[str]:
    options = ["--policy", "zero", "--format", "parquet", "--episodes", "1"]
    assert run_command(record_policy(*options)(work)).code == 0
    return record_policy(*options, "--seed", "1")(work)


def in_the_way(work: Workspace) -> Sequence[str]:
    (work.path / "out").write_text("mine")
    return record()(work)


def old_engine(content: bytes) -> bytes:
    report = json.loads(content)
    report["settings"]["engine"] = "mujoco 1.0"
    return json.dumps(report).encode()


CASES = [
    Case(name="nothing-to-record", make=lambda work: ["record", "--out", work.out], says=("--policy NAME",)),
    Case(name="both", make=record("--policy", "zero"), says=("either", "--policy NAME")),
    Case(name="no-evaluation", make=lambda work: ["record", str(work.path / "gone")], says=("not found", "gone")),
    Case(name="scenes-are-none", make=lambda work: ["record", str(work.scenes)], says=("evaluation", "scenes.json")),
    Case(name="unknown-format", make=record("--format", "lerobt"), says=("lerobt", "did you mean 'lerobot'")),
    Case(name="unknown-camera", make=record("--format", "video", "--cameras", "frnt"), says=("did you mean 'front'",)),
    Case(name="camera-twice", make=record("--format", "gif", "--cameras", "left,left"), says=("left,left", "once")),
    Case(name="video-without-cameras", make=record("--format", "video", "--cameras", "none"), says=("camera 'none'",)),
    Case(name="odd-pictures", make=record("--format", "lerobot", "--width", "33"), says=("33 x 240", "even sizes")),
    Case(name="large-pictures", make=record("--format", "lerobot", "--width", "9000"), says=("9000 x 240",)),
    Case(name="no-episodes", make=record("--episodes", "0"), says=("--episodes", "equal to 1")),
    Case(name="no-successes", make=record("--only-successes"), says=("none of 4 episodes is a success",)),
    Case(name="unknown-backend", make=record("--format", "video", "--backend", "vulkan"), says=("vulkan",)),
    Case(name="unknown-policy", make=record_policy("--policy", "plannr"), says=("did you mean 'planner'",)),
    Case(name="unknown-scenes", make=record_policy("--policy", "zero", "--scenes", "nowhere"), says=("nowhere",)),
    Case(name="other-scenes", make=another_split, says=("made on other scenes", "--scenes")),
    Case(name="other-engine", make=spoiled("report.json", old_engine), says=("mujoco 1.0", "results")),
    Case(name="report-damaged", make=spoiled("report.json", lambda it: it[:40]), says=("report.json",)),
    Case(name="actions-damaged", make=spoiled("actions.parquet", lambda it: it[:-9]), says=("actions.parquet",)),
    Case(name="actions-changed", make=flipped_actions, says=("boxes-0 pair 0", "do not lead to the recorded end")),
    Case(name="other-settings", make=other_settings, says=("point_clouds was False, is True", "--out")),
    Case(name="other-seed", make=other_seed, says=("seed was 0, is 1", "--out")),
    Case(name="file-in-the-way", make=in_the_way, says=("out", "in the way")),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_cannot_be_recorded_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    after = fingerprint(workspace.path)
    assert {name: after.get(name) for name in before} == before


@pytest.fixture
def rollouts(workspace: Workspace):
    """Good rollouts of two steps."""
    assert run_command(record_policy("--policy", "zero", "--format", "parquet", "--episodes", "2")(workspace)).code == 0
    return workspace.path / "out" / "rollouts"


def rewritten(file: str, change: Callable[[pa.Table], pa.Table], rows: int = 2):
    def spoil(folder) -> None:
        table = change(pq.read_table(folder / file))
        pq.write_table(table, folder / file, row_group_size=rows)

    return spoil


def cut(file: str):
    def spoil(folder) -> None:
        content = (folder / file).read_bytes()
        (folder / file).write_bytes(content[: len(content) // 2])

    return spoil


def another_version(table: pa.Table) -> pa.Table:
    return table.replace_schema_metadata({"clutter6d": json.dumps({"schema_version": 9})})


def renamed(table: pa.Table, old: str, new: str) -> pa.Table:
    changed = table.rename_columns([new if name == old else name for name in table.column_names])
    return changed.replace_schema_metadata(table.schema.metadata)


def emptied(table: pa.Table, name: str) -> pa.Table:
    field = table.schema.field(name)
    return table.set_column(table.schema.get_field_index(name), field, pa.nulls(len(table), field.type))


def without_outcome(table: pa.Table) -> pa.Table:
    index = table.schema.get_field_index("outcome")
    return table.set_column(index, "outcome", pa.array(["lost"] * len(table)))


DAMAGED = {
    "steps-cut": (cut("steps.parquet"), "steps.parquet: not readable"),
    "episodes-cut": (cut("episodes.parquet"), "episodes.parquet: not readable"),
    "no-table": (lambda folder: (folder / "steps.parquet").write_text("hello"), "steps.parquet: not readable"),
    "foreign-table": (rewritten("steps.parquet", lambda it: it.replace_schema_metadata({})), "schema version 1"),
    "other-version": (rewritten("steps.parquet", another_version), r"found: 9"),
    "column-missing": (rewritten("steps.parquet", lambda it: it.drop_columns(["action"])), "columns.*action"),
    "column-renamed": (
        rewritten("steps.parquet", lambda it: renamed(it, "reward", "prize")),
        "columns than expected: reward",
    ),
    "steps-missing": (rewritten("steps.parquet", lambda it: it.slice(0, 2)), "does not hold the episodes"),
    "step-missing": (rewritten("steps.parquet", lambda it: it.slice(1, 3)), "other steps than"),
    "cells-empty": (rewritten("steps.parquet", lambda it: emptied(it, "action")), "column action has empty cells"),
    "names-empty": (
        rewritten("episodes.parquet", lambda it: emptied(it, "object_names"), rows=1),
        "no names of objects",
    ),
    "final-empty": (
        rewritten("episodes.parquet", lambda it: emptied(it, "final_object_poses"), rows=1),
        "not readable",
    ),
    "outcome-unknown": (rewritten("episodes.parquet", without_outcome, rows=1), "episodes.parquet: not readable"),
}


@pytest.mark.parametrize(("spoil", "says"), DAMAGED.values(), ids=DAMAGED)
def test_damaged_rollouts_are_refused(spoil, says, rollouts) -> None:
    spoil(rollouts)
    with pytest.raises(InvalidFileError, match=says):
        list(read_rollouts(rollouts))


def test_rollouts_that_are_not_there_are_named(workspace: Workspace) -> None:
    with pytest.raises(MissingFileError, match="make some with: clutter6d record"):
        read_rollouts(workspace.scenes)
