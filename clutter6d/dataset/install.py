"""Installing assets that a data set names but does not carry: made from their source, compared with the frozen ones.

Equal input and equal versions give equal assets to the bit, so an installed asset is known by its content hash.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from clutter6d.assets.library import AssetLibrary, ProcessingRecord
from clutter6d.assets.processing import PROCESSING_VERSION, ProcessingSettings
from clutter6d.assets.run import RunSettings, fingerprint_of, run, settings_as_stored
from clutter6d.assets.sources.base import AssetSource, SourceObject
from clutter6d.assets.sources.registry import make_source
from clutter6d.dataset.dataset import Dataset
from clutter6d.dataset.manifest import MANIFEST_FILE
from clutter6d.errors import InvalidFileError, InvalidValueError


@dataclass(frozen=True, kw_only=True, slots=True)
class Installed:
    """What became of one asset that the data set names.

    Attributes:
        name: The asset's name.
        content_hash: The frozen hash.
        problem: Why the asset is not there, or not the frozen one; ``None`` if all is well.
    """

    name: str
    content_hash: str
    problem: str | None = None


def install(dataset: Dataset, *, workers: int = 1) -> Iterator[Installed]:
    """Make every asset of a data set in its library; those that are there already are not made again.

    Args:
        dataset: A data set that does not carry its assets.
        workers: Worker processes.

    Yields:
        Each asset as it is done.

    Raises:
        InvalidValueError: The data set carries its assets, or was made by another version of the processing.
        MissingFileError: What the source reads is not installed.
        MissingDependencyError: The source needs a package that is not installed.
        StorageError: The library cannot be written.
    """
    manifest = dataset.manifest
    if manifest.ships_assets:
        raise InvalidValueError(f"{dataset.name} carries its assets; there is nothing to install")
    if manifest.processing_version != PROCESSING_VERSION:
        raise InvalidValueError(
            f"{dataset.name} was made with version {manifest.processing_version} of the asset processing, this is "
            f"{PROCESSING_VERSION}; install the version of clutter6d that it came with"
        )
    sources = {pool: _open_source(dataset, pool) for pool in manifest.pools}
    settings = ProcessingSettings()
    library = AssetLibrary.create(dataset.library_path, settings_as_stored(settings))
    for pool, source in sources.items():
        yield from _install_pool(dataset, pool, source, library, settings, workers)


def unusable_scenes(dataset: Dataset, missing: Sequence[Installed]) -> int:
    """How many scenes use an asset that could not be installed."""
    hashes = {item.content_hash for item in missing}
    return sum(
        any(item.asset_hash in hashes for item in scene.objects)
        for name in dataset.split_names
        for scene in dataset.split(name).scenes
    )


def _open_source(dataset: Dataset, pool: str) -> AssetSource:
    entry = dataset.manifest.pools[pool]
    try:
        return make_source(entry.source, **entry.options)
    except (TypeError, AttributeError) as error:
        problem = f"pool {pool}: '{entry.source}' cannot be given these options ({error})"
        raise InvalidFileError(dataset.path / MANIFEST_FILE, problem) from None


def _install_pool(
    dataset: Dataset,
    pool: str,
    source: AssetSource,
    library: AssetLibrary,
    settings: ProcessingSettings,
    workers: int,
) -> Iterator[Installed]:
    rows = dataset.asset_list
    rows = rows[rows["pool"] == pool]
    frozen = dict(zip(rows["source_id"], zip(rows["name"], rows["content_hash"], strict=True), strict=True))
    items = {item.key: item for item in source.objects() if item.licence.source_id in frozen}
    for lost in frozen.keys() - {item.licence.source_id for item in items.values()}:
        name, content_hash = frozen[lost]
        problem = f"{lost} is not in the installed {source.name}; install the release that pool {pool} describes"
        yield Installed(name=name, content_hash=content_hash, problem=problem)
    wanted = {key: frozen[item.licence.source_id] for key, item in items.items()}
    for item in items.values():
        _forget_if_wrong(source, item, library, settings, wanted[item.key][1])
    for record in run(source, list(items.values()), library, settings, RunSettings(workers=workers)):
        name, content_hash = wanted[record.key]
        yield Installed(name=name, content_hash=content_hash, problem=_problem(record, content_hash))


def _forget_if_wrong(
    source: AssetSource, item: SourceObject, library: AssetLibrary, settings: ProcessingSettings, content_hash: str
) -> None:
    """Let what went wrong at an earlier installation be tried again."""
    fingerprint = fingerprint_of(source, item, settings)
    record = library.record(fingerprint)
    if record is not None and record.asset_hash != content_hash:
        library.forget(fingerprint)


def _problem(record: ProcessingRecord, content_hash: str) -> str | None:
    if record.status == "rejected":
        return f"{record.key}: {record.reason}: {record.detail}"
    if record.asset_hash != content_hash:
        return f"{record.asset_name}: its hash is {record.asset_hash[:12]}, the frozen asset's {content_hash[:12]}"
    return None
