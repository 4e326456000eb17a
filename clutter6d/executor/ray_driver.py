"""Tasks in the actors of a Ray cluster: one actor a worker, one item an actor, lost ones replaced."""

import logging
from collections.abc import Iterator, Sequence
from typing import Any

from clutter6d.errors import Clutter6DError, InvalidValueError
from clutter6d.executor.ray_cluster import connect
from clutter6d.executor.ray_worker import RayWorker, Surroundings, library_versions
from clutter6d.executor.task_queue import Outcome, TaskQueue
from clutter6d.executor.tasks import TaskFailure, TaskLimits, TaskResult
from clutter6d.executor.wire import Payload, encode

_log = logging.getLogger(__name__)
_IMPATIENCE_S = 20.0
_MAX_FAILED_STARTS = 5
_LOST = Outcome(failure=TaskFailure(kind="crash", stage="", detail="its worker or machine was lost"), is_lost=True)


def map_on_ray(
    function: Payload, items: Sequence[Any], workers: int, limits: TaskLimits, address: str
) -> Iterator[TaskResult[Any, Any]]:
    """Yield each item's result as it finishes; a free actor gets its next item before the caller sees the result.

    Raises:
        InvalidValueError: No cluster answers, or its workers cannot run the function as this process would.
    """
    ray = connect(address, workers)
    queue, pool = TaskQueue(items), _Pool(ray, function, limits, needs_cpu=bool(address))
    try:
        for _ in range(min(workers, len(items))):
            pool.add_actor()
        while queue or pool.running:
            for actor in pool.take_idle(queue):
                pool.start(actor, *queue.take())
            for index, outcome in pool.wait():
                result = queue.settle(index, outcome)
                for actor in pool.take_idle(queue):
                    pool.start(actor, *queue.take())
                if result is not None:
                    yield result
    finally:
        pool.close()


class _Pool:
    """Actors that start, idle or run an item; a dead one is replaced at once.

    An actor of a cluster without a free CPU waits as long as need be, and meanwhile gets no item; so the others never
    wait for it, and machines that join the cluster later work too.
    """

    def __init__(self, ray: Any, function: Payload, limits: TaskLimits, *, needs_cpu: bool) -> None:
        self._ray = ray
        self._remote = ray.remote(num_cpus=int(needs_cpu), max_restarts=0, max_task_retries=0)(RayWorker)
        self._arguments = (ray.put(function), limits, Surroundings())
        self._starting: dict[Any, Any] = {}
        self._idle: list[Any] = []
        self.running: dict[Any, tuple[Any, int]] = {}
        self._failed_starts = 0

    def add_actor(self) -> None:
        actor = self._remote.remote(*self._arguments)
        self._starting[actor.environment.remote()] = actor

    def take_idle(self, queue: TaskQueue[Any]) -> Iterator[Any]:
        """Idle actors, as long as items wait."""
        while queue and self._idle:
            yield self._idle.pop()

    def start(self, actor: Any, index: int, item: Any) -> None:
        """Give an actor an item."""
        self.running[actor.run.remote(index, encode(item))] = (actor, index)

    def wait(self) -> Iterator[tuple[int, Outcome]]:
        """Wait until something happens; yields the items that ended, and how."""
        references = [*self._starting, *self.running]
        done, _ = self._ray.wait(references, num_returns=1, timeout=_IMPATIENCE_S)
        if not done and not self.running:
            _log.warning("no worker is ready yet; does the cluster have free CPUs?")
        for reference in done:
            if reference in self._starting:
                self._welcome(reference)
            else:
                actor, index = self.running.pop(reference)
                yield index, self._outcome(reference, actor)

    def _welcome(self, reference: Any) -> None:
        actor = self._starting.pop(reference)
        try:
            machine, versions = self._get(reference)
        except _ActorLostError as error:
            self._failed_starts += 1
            if self._failed_starts >= _MAX_FAILED_STARTS or error.is_own_fault:
                raise InvalidValueError(f"a Ray worker does not start: {error}") from None
            self.add_actor()
            return
        _check_versions(machine, versions)
        self._failed_starts = 0
        self._idle.append(actor)

    def _outcome(self, reference: Any, actor: Any) -> Outcome:
        try:
            outcome: Outcome = self._get(reference)
        except _ActorLostError as error:
            _log.debug("worker lost: %s", error)
            self._ray.kill(actor)  # it may only be out of reach
            self.add_actor()
            return _LOST
        self._idle.append(actor)
        return outcome

    def _get(self, reference: Any) -> Any:
        """The value of a reference; an error of this package is raised as itself."""
        try:
            return self._ray.get(reference)
        except self._ray.exceptions.RayTaskError as error:
            cause = error.cause
            if isinstance(cause, Clutter6DError):
                raise cause from None
            raise _ActorLostError(str(cause), is_own_fault=True) from None
        except self._ray.exceptions.RayError as error:
            is_own_fault = getattr(error, "actor_init_failed", False)
            raise _ActorLostError(str(error), is_own_fault=is_own_fault) from None

    def close(self) -> None:
        """Kill every actor, and with it its process."""
        running = (actor for actor, _ in self.running.values())
        for actor in (*self._idle, *self._starting.values(), *running):
            self._ray.kill(actor)


class _ActorLostError(Exception):
    """An actor is gone, or never came."""

    def __init__(self, detail: str, *, is_own_fault: bool) -> None:
        super().__init__(" ".join(detail.split())[:300])
        self.is_own_fault = is_own_fault


def _check_versions(machine: str, theirs: dict[str, str]) -> None:
    ours = library_versions()
    for name in sorted(ours.keys() & theirs.keys()):
        if ours[name] != theirs[name]:
            raise InvalidValueError(
                f"machine '{machine}' of the cluster has {name} {theirs[name]}, this one {ours[name]}; "
                "install the same environment on every machine"
            )
