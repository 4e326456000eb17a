"""An evaluation's episodes in workers: each writes its own into the journal as they end, so a kill loses little."""

from collections.abc import Callable, Iterator, Sequence
from math import ceil

from clutter6d.errors import SimulationError
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.evaluator import Evaluation, Part
from clutter6d.eval.runner import EpisodeKey
from clutter6d.executor import LOCAL, Executor, TaskResult, map_tasks

Chunk = tuple[EpisodeKey, ...]


class EpisodeTask:
    """Runs some episodes; picklable, and keeps scenes and policy from one call to the next.

    Args:
        open_evaluation: Opens the evaluation, in the worker; it finds that scenes and policy are the same there.
        part: The policy's own episodes, or the same without any action.
        num_envs: Episodes at once.
        threads: Threads of a worker's simulation.
    """

    def __init__(self, open_evaluation: Callable[[], Evaluation], part: Part, *, num_envs: int, threads: int) -> None:
        self._open_evaluation, self._num_envs, self._threads = open_evaluation, num_envs, threads
        self._part: Part = part
        self._evaluation: Evaluation | None = None

    def __call__(self, keys: Chunk) -> tuple[EpisodeRow, ...]:
        """Run those of some episodes that are not done yet; returns the rows of all of them."""
        if self._evaluation is None:
            self._evaluation = self._open_evaluation()
        for _ in self._evaluation.run(self._part, keys=keys, num_envs=self._num_envs, threads=self._threads):
            pass
        return tuple(record.row for record in self._evaluation.finished(self._part, keys=keys).values())


def run_in_workers(
    evaluation: Evaluation,
    open_evaluation: Callable[[], Evaluation],
    part: Part = "journal",
    *,
    num_envs: int = 16,
    threads: int = 1,
    workers: int = 1,
    executor: Executor = LOCAL,
) -> Iterator[EpisodeRow]:
    """Run what is not done yet in workers; the outcome does not depend on how many there are, or where.

    Args:
        evaluation: What is run.
        open_evaluation: Opens the same in a worker; picklable.
        part: The policy's own episodes, or the same without any action.
        num_envs: Episodes at once in each worker.
        threads: Threads of each worker's simulation.
        workers: Workers.
        executor: Where they are; on a cluster, scenes, policy and results are on a shared file system.

    Raises:
        SimulationError: A worker failed; the episodes that ended are kept.
    """
    done = evaluation.finished(part)
    missing = [key for key in evaluation.keys if key not in done]
    task = EpisodeTask(open_evaluation, part, num_envs=num_envs, threads=threads)
    chunks = _in_chunks(missing, min(2 * num_envs, ceil(len(missing) / workers)))
    for result in map_tasks(task, chunks, workers=workers, executor=executor):
        yield from _unwrap(result)


def _in_chunks(keys: Sequence[EpisodeKey], size: int) -> list[Chunk]:
    return [tuple(keys[start : start + size]) for start in range(0, len(keys), max(size, 1))]


def _unwrap(result: TaskResult[Chunk, tuple[EpisodeRow, ...]]) -> tuple[EpisodeRow, ...]:
    if result.value is not None:
        return result.value
    failure, (scene_id, pair) = result.failure, result.item[0]
    if failure is not None and failure.error is not None:
        raise failure.error
    what = f"{failure.kind}: {failure.detail}" if failure else "no result"
    raise SimulationError(f"episodes from {scene_id} pair {pair} on: worker failed ({what}); run it again")
