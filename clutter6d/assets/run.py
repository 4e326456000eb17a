"""Processing a whole source into a library: in child processes, resumable, everything on record."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from clutter6d.assets.asset_file import PackedAsset, pack_asset
from clutter6d.assets.decomposition import Effort
from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from clutter6d.assets.processing import ProcessingSettings, process_object
from clutter6d.assets.sources.base import AssetSource, SourceObject
from clutter6d.errors import MeshRejectedError
from clutter6d.executor import LOCAL, Executor, TaskFailure, TaskLimits, TaskResult, map_tasks

UNAVAILABLE = "unavailable"
"""Reason of an object that could not be downloaded; the next run tries again."""
_LESS_EFFORT: dict[Effort, Effort] = {"normal": "coarse", "coarse": "hull"}
_REASONS = {"crash": "crashed", "timeout": "timed-out", "memory": "out-of-memory", "error": "failed"}


@dataclass(frozen=True, kw_only=True, slots=True)
class RunSettings:
    """How a source is processed; none of this changes an asset.

    Attributes:
        workers: Worker processes.
        executor: Where they are.
        seconds: Processor time that one object may take at one effort.
        memory_bytes: Address space that one object may use.
    """

    workers: int = 1
    executor: Executor = LOCAL
    seconds: float = 60.0
    memory_bytes: int = 4 << 30


@dataclass(frozen=True, kw_only=True, slots=True)
class _Job:
    item: SourceObject
    fingerprint: str
    effort: Effort = "normal"
    fallbacks: tuple[str, ...] = ()
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class _Task:
    """What a worker does; sent to it once. The worker packs, so that the one process that stores does little."""

    source: AssetSource
    settings: ProcessingSettings = field(default_factory=ProcessingSettings)

    def __call__(self, job: _Job) -> PackedAsset:
        asset = process_object(self.source, job.item, self.settings, effort=job.effort)
        fallbacks = (*job.fallbacks, *asset.quality.fallbacks)
        return pack_asset(replace(asset, quality=replace(asset.quality, fallbacks=fallbacks)))


def settings_as_stored(settings: ProcessingSettings) -> dict[str, Any]:
    """The settings as plain values, as a library keeps them."""
    return json.loads(json.dumps(asdict(settings)))


def run(
    source: AssetSource,
    items: Sequence[SourceObject],
    library: AssetLibrary,
    settings: ProcessingSettings,
    run_settings: RunSettings,
) -> Iterator[ProcessingRecord]:
    """Process objects and yield the record of each; those with a record already are yielded from it.

    An object whose convex parts killed the process is tried again coarser, then as its hull.

    Raises:
        StorageError: The library cannot be written; everything finished before is kept.
    """
    jobs: list[_Job] = []
    for item in items:
        job = _Job(item=item, fingerprint=fingerprint_of(source, item, settings))
        record = library.record(job.fingerprint)
        if record is None or record.reason == UNAVAILABLE:
            jobs.append(job)
        else:
            yield record
    limits = TaskLimits(seconds=run_settings.seconds, memory_bytes=run_settings.memory_bytes)
    workers, executor = run_settings.workers, run_settings.executor
    while jobs:
        again: list[_Job] = []
        for result in map_tasks(_Task(source, settings), jobs, workers=workers, limits=limits, executor=executor):
            retry = _retry(result)
            if retry is not None:
                again.append(retry)
                continue
            yield _store(library, source, result)
        jobs = again


def fingerprint_of(source: AssetSource, item: SourceObject, settings: ProcessingSettings) -> str:
    """The key of the processing cache: the object's own fingerprint and the settings."""
    content = [source.name, source.fingerprint(item), settings_as_stored(settings)]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def _retry(result: TaskResult[_Job, PackedAsset]) -> _Job | None:
    """The same job with less effort, if its convex parts are what killed it."""
    job, failure = result.item, result.failure
    if failure is None or failure.stage != "decomposition" or isinstance(failure.error, MeshRejectedError):
        return None
    if job.effort not in _LESS_EFFORT:
        return None
    note = f"decomposition:{job.effort}-{_REASONS[failure.kind]}"
    return replace(
        job,
        effort=_LESS_EFFORT[job.effort],
        fallbacks=(*job.fallbacks, note),
        seconds=job.seconds + result.seconds,
    )


def _store(library: AssetLibrary, source: AssetSource, result: TaskResult[_Job, PackedAsset]) -> ProcessingRecord:
    job = result.item
    record = ProcessingRecord(
        fingerprint=job.fingerprint,
        source=source.name,
        key=job.item.key,
        name=job.item.name,
        status="rejected",
        seconds=round(job.seconds + result.seconds, 4),
        fallbacks=job.fallbacks,
    )
    if result.value is not None:
        stored = library.add_packed(result.value)
        found = {"asset_name": stored.name, "asset_hash": stored.content_hash, "fallbacks": stored.quality.fallbacks}
        record = record.model_copy(update={"status": "accepted", **found})
    elif result.failure is not None:
        record = record.model_copy(update=_explain(result.failure))
    library.add_record(record)
    return record


def _explain(failure: TaskFailure) -> dict[str, str]:
    if isinstance(failure.error, MeshRejectedError):
        return {"reason": failure.error.reason, "detail": failure.error.detail}
    where = f" in stage {failure.stage}" if failure.stage else ""
    return {"reason": _REASONS[failure.kind], "detail": f"{failure.detail}{where}"}
