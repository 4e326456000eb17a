"""The commands ``clutter6d evaluate`` and ``clutter6d replay``."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Column, Table

from clutter6d.dataset.scenes import SceneCollection, open_scenes
from clutter6d.envs.tasks import TaskSource
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.envs.unstable_state import replay_unstable
from clutter6d.errors import MissingFileError
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.episode_tasks import run_in_workers
from clutter6d.eval.evaluator import REPORT_FILE, Evaluation, EvaluationConfig, Part
from clutter6d.eval.policy import PolicyOptions, is_planner
from clutter6d.eval.policy_loading import load_policy
from clutter6d.eval.replay import Replay
from clutter6d.eval.report import Report, to_table
from clutter6d.executor import EXECUTOR_HELP, LOCAL, Executor, parse_executor
from clutter6d.progress import progress_bars
from clutter6d.schema import FileModel, read_model, write_model

SCENES_FILE = "scenes.json"
PARALLEL_EPISODES = 16
"""A policy that plans takes seconds an episode, so it runs one at a time: a kill then loses one, not sixteen."""


class ScenesLocation(FileModel):
    """``scenes.json``: where the scenes of an evaluation were, so that ``replay`` finds them."""

    schema_version: int = 1
    scenes: str


def evaluate(
    policy: Annotated[str, typer.Option(help="zero, random, planner, package.module:factory, or a .pt checkpoint.")],
    scenes: Annotated[
        str, typer.Option(help="A frozen split, such as dense-test, or a folder made by clutter6d generate.")
    ] = "sparse-test",
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results, by default evaluations/POLICY-SCENES; an unfinished one is continued."
        ),
    ] = None,
    pairs: Annotated[int | None, typer.Option(min=1, help="Goal pairs of each scene, the first; default all.")] = None,
    sample: Annotated[
        int | None,
        typer.Option(min=1, help="Scenes drawn at random, the same for everyone; the paper's human row has 10."),
    ] = None,
    num_envs: Annotated[
        int | None,
        typer.Option(
            min=1, help="Episodes that run at once; default 16, or 1 for a policy that plans in the simulator."
        ),
    ] = None,
    threads: Annotated[int, typer.Option(min=0, help="Threads; 0 for all cores, or one in each of many workers.")] = 0,
    workers: Annotated[int, typer.Option(min=1, help="Worker processes, each with its own episodes at once.")] = 1,
    executor: Annotated[str, typer.Option(help=EXECUTOR_HELP)] = "local",
    seed: Annotated[int, typer.Option(help="Seed of everything the policy draws.")] = 0,
    max_steps: Annotated[
        int, typer.Option(min=1, help="Steps of an episode at most; other than 300 is not official.")
    ] = MAX_CONTROL_STEPS,
) -> None:
    """Run a policy on scenes and write its table; the result does not depend on what runs at once, or where."""
    collection, where = open_all_scenes(scenes), parse_executor(executor)
    loaded = load_policy(policy, PolicyOptions(seed=seed, threads=threads))
    config = EvaluationConfig(pairs=pairs, sample=sample, seed=seed, max_steps=max_steps)
    out = out or default_folder(loaded.name, scenes, sample)
    evaluation = Evaluation(collection, loaded, out, config)
    remember_scenes(out, scenes)
    again = partial(_open_evaluation, scenes, policy, out.resolve(), config)
    run = partial(_run, evaluation, again, threads=threads, workers=workers, executor=where)
    console = Console(markup=False, emoji=False)
    with progress_bars(console) as progress:
        at_once = num_envs or (1 if is_planner(loaded) else PARALLEL_EPISODES)
        _show(evaluation, progress, loaded.name, run("journal", num_envs=at_once))
        done = len(evaluation.finished("floor"))
        bar = progress.add_task("zero action (floor)", total=len(evaluation.keys), completed=done)
        for _ in run("floor", num_envs=num_envs or PARALLEL_EPISODES):
            progress.advance(bar)
    print_report(evaluation.finish(), out, console)


def replay(
    folder: Annotated[Path, typer.Argument(help="What clutter6d evaluate wrote, or the file of an unstable state.")],
    scenes: Annotated[str | None, typer.Option(help="The scenes, if they are no longer where they were.")] = None,
    num_envs: Annotated[int, typer.Option(min=1, help="Episodes that run at once.")] = PARALLEL_EPISODES,
    threads: Annotated[int, typer.Option(min=0, help="Threads; 0 for all cores.")] = 0,
) -> None:
    """Simulate the recorded actions again; exit code 1 unless every outcome and metric is the same to the bit."""
    if folder.is_file():
        _replay_unstable(folder, scenes)
        return
    if not folder.is_dir():
        raise MissingFileError("evaluation", folder, "make one with: clutter6d evaluate")
    found = scenes or read_model(folder / SCENES_FILE, ScenesLocation, what="scenes of the evaluation").scenes
    check, console = Replay(folder, open_all_scenes(found)), Console(markup=False, emoji=False)
    differing = 0
    with progress_bars(console) as progress:
        bar = progress.add_task("replaying", total=2 * len(check.keys))
        for verdict in check.run(num_envs=num_envs, threads=threads):
            progress.advance(bar)
            differing += not verdict.is_identical
            what = "identical" if verdict.is_identical else f"DIFFERS in {', '.join(verdict.differing)}"
            progress.console.print(f"{verdict.scene_id} pair {verdict.pair}: {what}", highlight=False)
        wrong = check.check_report(num_envs=num_envs, threads=threads)
        progress.advance(bar, len(check.keys))
    if wrong:
        console.print(f"{folder / REPORT_FILE} does not follow from the episodes: {', '.join(wrong)}")
    console.print(f"{len(check.keys) - differing} of {len(check.keys)} episodes identical to the bit")
    if differing or wrong:
        raise typer.Exit(1)


def _replay_unstable(path: Path, scenes: str | None) -> None:
    """Simulate the step that became invalid again."""
    remembered = path.resolve().parent.parent / SCENES_FILE
    if scenes is None and not remembered.is_file():
        raise MissingFileError("scenes of the unstable state", remembered, "name them by --scenes")
    found = scenes or read_model(remembered, ScenesLocation, what="scenes of the evaluation").scenes
    fails = replay_unstable(path, TaskSource(open_scenes(found), kept_models=1))
    print(f"{path.stem}: the step becomes invalid again" if fails else f"{path.stem}: the step is valid this time")
    if not fails:
        raise typer.Exit(1)


def open_all_scenes(where: str) -> SceneCollection:
    """The scenes, every one read now: a damaged one ends the command before anything is written."""
    collection = open_scenes(where)
    _ = collection.scenes
    return collection


def default_folder(name: str, scenes: str, sample: int | None) -> Path:
    """Where an evaluation goes that was given no folder."""
    return Path("evaluations") / "-".join([name, Path(scenes).name, *([f"sample{sample}"] if sample else [])])


def remember_scenes(out: Path, scenes: str) -> None:
    """Write where the scenes are, so that ``replay`` finds them."""
    where = str(Path(scenes).resolve()) if Path(scenes).exists() else scenes
    write_model(out / SCENES_FILE, ScenesLocation(scenes=where))


def _open_evaluation(scenes: str, policy: str, out: Path, config: EvaluationConfig) -> Evaluation:
    """The evaluation once more, in a worker."""
    return Evaluation(
        open_all_scenes(scenes), load_policy(policy, PolicyOptions(seed=config.seed, threads=1)), out, config
    )


def _run(
    evaluation: Evaluation,
    again: Callable[[], Evaluation],
    part: Part,
    *,
    num_envs: int,
    threads: int,
    workers: int,
    executor: Executor,
) -> Iterator[EpisodeRow]:
    """Run the episodes that are left, in this process or in workers."""
    if workers == 1 and executor == LOCAL:
        return evaluation.run(part, num_envs=num_envs, threads=threads)
    return run_in_workers(
        evaluation, again, part, num_envs=num_envs, threads=threads or 1, workers=workers, executor=executor
    )


def _show(evaluation: Evaluation, progress: Progress, name: str, rows: Iterator[EpisodeRow]) -> None:
    """Show the episodes as they end, and the running success rate."""
    before = evaluation.finished()
    done, successes = len(before), sum(record.row.is_success for record in before.values())
    bar = progress.add_task(_describe(name, successes, done), total=len(evaluation.keys), completed=done)
    for row in rows:
        done, successes = done + 1, successes + row.is_success
        progress.update(bar, advance=1, description=_describe(name, successes, done))


def _describe(name: str, successes: int, done: int) -> str:
    return f"{name}: {successes / done:.0%} success" if done else name


def print_report(report: Report, out: Path, console: Console) -> None:
    """Show the table, and where it was written."""
    table = Table("", Column(overflow="fold"), show_header=False, title=f"{report.policy} ({report.label})")
    for name, value in to_table(report):
        table.add_row(name, value)
    console.print(table)
    console.print(f"written to {out}")
