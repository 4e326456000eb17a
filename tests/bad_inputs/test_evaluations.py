"""Evaluations that are damaged, tampered with or of another kind; met by ``replay`` and by continuing them."""

import json
from collections.abc import Callable, Sequence
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.bad_inputs.harness import Case, Workspace, check_refusal, fingerprint, run_command


def replay(work: Workspace) -> Sequence[str]:
    return ["replay", str(work.results), "--scenes", str(work.scenes)]


def resume(work: Workspace) -> Sequence[str]:
    return [
        "evaluate", "--policy", "zero", "--scenes", str(work.scenes), "--out", str(work.results), "--max-steps", "3"
    ]  # fmt: skip


def replaced(file: str, content: bytes, command: Callable[[Workspace], Sequence[str]] = replay):
    def make(work: Workspace) -> Sequence[str]:
        (work.results / file).write_bytes(content)
        return command(work)

    return make


def cut(file: str, command: Callable[[Workspace], Sequence[str]] = replay):
    def make(work: Workspace) -> Sequence[str]:
        path = work.results / file
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        return command(work)

    return make


def removed(file: str):
    def make(work: Workspace) -> Sequence[str]:
        (work.results / file).unlink()
        return replay(work)

    return make


def edited(file: str, change: Callable[[Any], object], command: Callable[[Workspace], Sequence[str]] = replay):
    def make(work: Workspace) -> Sequence[str]:
        path = work.results / file
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))
        return command(work)

    return make


def table(file: str, change: Callable[[pd.DataFrame], pd.DataFrame | None]):
    def make(work: Workspace) -> Sequence[str]:
        frame = pd.read_parquet(work.results / file)
        changed = change(frame)
        (frame if changed is None else changed).to_parquet(work.results / file, index=False)
        return replay(work)

    return make


def many_rows(work: Workspace) -> Sequence[str]:
    """Six million rows in some kilobytes."""
    schema = pq.read_schema(work.results / "actions.parquet")
    count = 6_000_000
    values = {field.name: "boxes-0" if field.name == "scene_id" else 0 for field in schema}
    columns = {field.name: pa.repeat(pa.scalar(values[field.name], field.type), count) for field in schema}
    pq.write_table(pa.table(columns, schema=schema), work.results / "actions.parquet", compression="zstd")
    return replay(work)


def other_scenes(work: Workspace) -> Sequence[str]:
    path = work.scenes / "scenes" / "boxes-0" / "scene.json"
    path.write_text(path.read_text() + "\n")
    return replay(work)


def assign(column: str, row: int, value: object) -> Callable[[pd.DataFrame], None]:
    def change(frame: pd.DataFrame) -> None:
        if frame[column].dtype != object and isinstance(value, str):
            frame[column] = frame[column].astype(object)
        frame.loc[row, column] = value

    return change


EPISODE = "journal/boxes-0@0000.json"

CASES = [
    Case(name="report-missing", make=removed("report.json"), says=("report not found", "report.json")),
    Case(name="report-truncated", make=cut("report.json"), says=("report.json", "not a valid report")),
    Case(
        name="report-with-unknown-field",
        make=edited("report.json", lambda it: it.update(x=1)),
        says=("report.json", "x"),
    ),
    Case(
        name="report-without-success-rate",
        make=edited("report.json", lambda it: it.pop("success_rate")),
        says=("report.json", "success_rate"),
    ),
    Case(
        name="report-of-another-engine",
        make=edited("report.json", lambda it: it["settings"].update(engine="mujoco 3.2.0")),
        says=("mujoco 3.2.0", "install that version"),
    ),
    Case(
        name="report-of-absurd-steps",
        make=edited("report.json", lambda it: it["settings"].update(max_steps=0)),
        says=("report.json", "max_steps"),
    ),
    Case(
        name="report-of-absurd-scale",
        make=edited("report.json", lambda it: it["settings"].update(action_scale_rad=-1.0)),
        says=("action",),
    ),
    Case(
        name="report-of-no-pairs",
        make=edited("report.json", lambda it: it["settings"].update(pairs=-1)),
        says=("report.json", "pairs"),
    ),
    Case(name="scenes-changed-since", make=other_scenes, says=("not the scenes of the evaluation", "--scenes")),
    Case(
        name="scenes-file-missing",
        make=lambda work: [(work.results / "scenes.json").unlink(), ["replay", str(work.results)]][1],
        says=("scenes of the evaluation not found", "scenes.json"),
    ),
    Case(
        name="scenes-file-names-nothing",
        make=edited(
            "scenes.json", lambda it: it.update(scenes="/nowhere/at/all"), lambda work: ["replay", str(work.results)]
        ),
        says=("scene set not found", "/nowhere/at/all"),
    ),
    Case(name="episodes-missing", make=removed("episodes.parquet"), says=("not found", "episodes.parquet")),
    Case(name="episodes-truncated", make=cut("episodes.parquet"), says=("episodes.parquet", "not a Parquet table")),
    Case(
        name="episodes-are-csv",
        make=replaced("episodes.parquet", b"scene_id,pair\nboxes-0,0\n"),
        says=("episodes.parquet", "not a Parquet table"),
    ),
    Case(
        name="episodes-lack-a-column",
        make=table("episodes.parquet", lambda frame: frame.drop(columns="steps")),
        says=("episodes.parquet", "steps"),
    ),
    Case(
        name="episodes-with-another-column",
        make=table("episodes.parquet", lambda frame: frame.assign(bonus=1.0)),
        says=("episodes.parquet", "bonus"),
    ),
    Case(
        name="episode-missing-in-the-table",
        make=table("episodes.parquet", lambda frame: frame[1:]),
        says=("episodes.parquet", "boxes-0 pair 0"),
    ),
    Case(
        name="episode-twice-in-the-table",
        make=table("episodes.parquet", lambda frame: pd.concat([frame, frame[:1]])),
        says=("episodes.parquet", "boxes-0 pair 0"),
    ),
    Case(
        name="episode-of-a-strange-outcome",
        make=table("episodes.parquet", assign("outcome", 0, "glory")),
        says=("episodes.parquet", "outcome"),
    ),
    Case(
        name="episode-metric-nan",
        make=table("episodes.parquet", assign("mean_offset_cm", 0, float("nan"))),
        says=("episodes.parquet", "mean_offset_cm"),
    ),
    Case(name="actions-missing", make=removed("actions.parquet"), says=("not found", "actions.parquet")),
    Case(name="actions-truncated", make=cut("actions.parquet"), says=("actions.parquet", "not a Parquet table")),
    Case(
        name="actions-nan",
        make=table("actions.parquet", assign("action_1", 2, float("nan"))),
        says=("actions.parquet", "not finite"),
    ),
    Case(
        name="actions-as-doubles",
        make=table("actions.parquet", lambda frame: frame.assign(action_2=frame["action_2"].astype("float64"))),
        says=("actions.parquet", "not float32"),
    ),
    Case(
        name="actions-lack-a-step",
        make=table("actions.parquet", lambda frame: frame.drop(index=1)),
        says=("actions.parquet", "boxes-0 pair 0", "0, 1, 2"),
    ),
    Case(
        name="actions-pair-in-words",
        make=table("actions.parquet", lambda frame: frame.assign(pair=frame["pair"].astype(str) + "st")),
        says=("actions.parquet", "pair"),
    ),
    Case(
        name="actions-of-another-scene",
        make=table("actions.parquet", lambda frame: frame.replace({"scene_id": {"boxes-1": "boxes-7"}})),
        says=("actions.parquet", "boxes-"),
    ),
    Case(name="actions-row-bomb", make=many_rows, says=("actions.parquet", "6,000,000 rows")),
    Case(name="run-file-truncated", make=cut("run.json", resume), says=("run.json", "not a valid evaluation")),
    Case(name="journal-truncated", make=cut(EPISODE, resume), says=("boxes-0@0000.json", "not a valid episode file")),
    Case(
        name="journal-outcome-strange",
        make=edited(EPISODE, lambda it: it["row"].update(outcome="glory"), resume),
        says=("boxes-0@0000.json", "outcome"),
    ),
    Case(
        name="journal-actions-changed",
        make=edited(EPISODE, lambda it: it.update(actions_base64="AACAPw==" * 21), resume),
        says=("boxes-0@0000.json", "actions", "delete it"),
    ),
    Case(
        name="journal-actions-no-base64",
        make=edited(EPISODE, lambda it: it.update(actions_base64="%%%"), resume),
        says=("boxes-0@0000.json", "actions", "delete it"),
    ),
    Case(
        name="journal-of-another-episode",
        make=lambda work: [
            (work.results / EPISODE).write_bytes((work.results / "journal/boxes-1@0001.json").read_bytes()),
            resume(work),
        ][1],
        says=("boxes-0@0000.json", "boxes-1"),
    ),
]

TAMPERED = {
    "success-claimed": table("episodes.parquet", assign("is_success", 0, True)),
    "action-changed": table("actions.parquet", assign("action_1", 2, 0.05)),
    "offset-improved": table("episodes.parquet", assign("mean_offset_cm", 0, 1.0)),
    "rate-improved": edited("report.json", lambda it: it.update(success_rate=0.9)),
    "official-claimed": edited("report.json", lambda it: it.update(label="official")),
}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_damaged_evaluation_is_refused_and_nothing_is_touched(case: Case, workspace: Workspace) -> None:
    arguments = case.make(workspace)
    before = fingerprint(workspace.path)
    check_refusal(run_command(arguments), case.code, case.says)
    assert fingerprint(workspace.path) == before


@pytest.mark.parametrize("tampered", TAMPERED.values(), ids=TAMPERED)
def test_a_tampered_evaluation_is_seen_through(tampered, workspace: Workspace) -> None:
    arguments = tampered(workspace)
    before = fingerprint(workspace.path)
    outcome = run_command(arguments)
    assert outcome.code == 1, outcome.err
    assert "DIFFERS" in outcome.out or "does not follow from the episodes" in outcome.out
    assert outcome.err == ""
    assert fingerprint(workspace.path) == before


def test_an_honest_evaluation_replays(workspace: Workspace) -> None:
    outcome = run_command(replay(workspace))
    assert (outcome.code, outcome.err) == (0, "")
