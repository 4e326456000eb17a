"""The formats that a scene can be exported to, and the one way to do it."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name

from clutter6d.assets.asset import Asset
from clutter6d.errors import UnknownNameError
from clutter6d.scene import Scene

FORMATS: Mapping[str, str] = {
    "mjcf": "clutter6d.export.mjcf:export_mjcf",
    "usd": "clutter6d.export.usd:export_usd",
    "usdz": "clutter6d.export.usd:export_usdz",
    "glb": "clutter6d.export.glb:export_glb",
}
"""Where each format's exporter is; it is imported when it is used."""


Exporter = Callable[[Scene, Mapping[str, Asset], Path], Path]
"""Writes a scene with its assets into a folder and returns the main file's path."""


def parse_formats(text: str) -> tuple[str, ...]:
    """Names of formats, separated by commas; each once.

    Raises:
        UnknownNameError: One is not known.
    """
    names = tuple(dict.fromkeys(name.strip().lower() for name in text.split(",") if name.strip()))
    for name in names:
        if name not in FORMATS:
            raise UnknownNameError("export format", name, FORMATS)
    return names


def export_scene(scene: Scene, assets: Mapping[str, Asset], out: Path, formats: Sequence[str]) -> tuple[Path, ...]:
    """Write a scene to ``OUT/FORMAT/SCENE_ID``, in each format.

    Args:
        scene: The scene.
        assets: Its assets by content hash.
        out: Where to; made if missing.
        formats: Names of formats.

    Returns:
        Path of each format's main file.

    Raises:
        InvalidValueError: A file is in the way.
        StorageError: The folder cannot be written.
    """
    return tuple(_exporter(name)(scene, assets, out / name / scene.scene_id) for name in formats)


def _exporter(name: str) -> Exporter:
    return resolve_name(FORMATS[name])
