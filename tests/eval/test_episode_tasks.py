"""Episodes in workers: the same tables as in this process, and a finished episode is never run again."""

from functools import partial
from pathlib import Path

import pytest

from clutter6d.cli import run
from clutter6d.errors import InvalidValueError
from clutter6d.eval.builtin_policies import make_random
from clutter6d.eval.episode_tasks import EpisodeTask, run_in_workers
from clutter6d.eval.evaluator import Evaluation, EvaluationConfig
from clutter6d.eval.policy import PolicyOptions
from clutter6d.scenegen.scene_set import SceneSet
from tests.executor.trees import tree
from tests.scene_fixtures import write_box_scene_set

CONFIG = EvaluationConfig(max_steps=6)


def open_evaluation(scenes: Path, out: Path, config: EvaluationConfig = CONFIG) -> Evaluation:
    return Evaluation(SceneSet.open(scenes), make_random(PolicyOptions(seed=config.seed)), out, config)


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_box_scene_set(tmp_path_factory.mktemp("scenes") / "scenes").path


def test_the_tables_do_not_depend_on_the_workers(scenes: Path, tmp_path: Path) -> None:
    command = ["evaluate", "--policy", "random", "--scenes", str(scenes), "--max-steps", "6"]
    for workers in ("1", "2"):
        assert run([*command, "--workers", workers, "--out", str(tmp_path / workers)]) == 0
    assert tree(tmp_path / "1") == tree(tmp_path / "2")


def test_only_what_is_missing_is_run(scenes: Path, tmp_path: Path) -> None:
    evaluation, again = open_evaluation(scenes, tmp_path), partial(open_evaluation, scenes, tmp_path)
    first = list(evaluation.run(keys=evaluation.keys[:1]))
    rest = list(run_in_workers(evaluation, again, num_envs=1))
    assert [row.key for row in first] == [evaluation.keys[0]]
    assert sorted(row.key for row in rest) == sorted(evaluation.keys[1:])
    assert list(run_in_workers(evaluation, again)) == []


def test_an_episode_whose_worker_was_lost_after_it_ended_is_not_run_again(scenes: Path, tmp_path: Path) -> None:
    evaluation = open_evaluation(scenes, tmp_path)
    (before,) = evaluation.run(keys=evaluation.keys[:1])
    task = EpisodeTask(partial(open_evaluation, scenes, tmp_path), "journal", num_envs=2, threads=1)
    rows = task(evaluation.keys[:2])
    assert rows[0] == before  # with its time
    assert [row.key for row in rows] == list(evaluation.keys[:2])


def test_a_worker_with_another_policy_is_refused(scenes: Path, tmp_path: Path) -> None:
    evaluation = open_evaluation(scenes, tmp_path)
    another = partial(open_evaluation, scenes, tmp_path, EvaluationConfig(max_steps=6, seed=5))
    with pytest.raises(InvalidValueError, match="other settings"):
        list(run_in_workers(evaluation, another))
