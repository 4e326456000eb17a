"""A folder of scenes that carries its assets with it, so that it can be moved, shared and evaluated as it is.

scene_set.json                     track, seed and library it was made from
scenes/<scene_id>/scene.json       one scene
scenes/<scene_id>/generation.json  what it took to make it
library/                           the asset library of exactly the assets used
"""

import hashlib
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Literal

import pandas as pd

from clutter6d.assets.asset import Asset
from clutter6d.assets.library import AssetLibrary
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError
from clutter6d.scene import Scene
from clutter6d.scene_file import read_scene, write_scene
from clutter6d.scenegen.scene_assets import SceneAssets
from clutter6d.schema import FileModel, read_model, write_model

HEADER = "scene_set.json"


class SceneSetFile(FileModel):
    """``scene_set.json``: what every scene of the folder has in common."""

    schema_version: Literal[1] = 1
    format: Literal["clutter6d-scene-set"] = "clutter6d-scene-set"
    track: str
    seed: int
    library_sha256: str
    generator_version: str


class GenerationRecord(FileModel):
    """``generation.json``: failed attempts and states by reason, and the time one scene took."""

    schema_version: Literal[1] = 1
    failures: dict[str, int]
    seconds: float


def assets_sha256(content_hashes: Iterable[str]) -> str:
    """Hash over the content hashes of some assets, in any order."""
    return hashlib.sha256("".join(sorted(content_hashes)).encode()).hexdigest()


def scenes_sha256(sha256_by_id: Mapping[str, str]) -> str:
    """Hash over the ids and hashes of some scenes, in any order; names a set of scenes in every table."""
    lines = (f"{scene_id} {sha256_by_id[scene_id]}\n" for scene_id in sorted(sha256_by_id))
    return hashlib.sha256("".join(lines).encode()).hexdigest()


class SceneSet:
    """Scenes of one folder; scenes and assets are read when first asked for.

    Args:
        path: The folder.
        header: Its ``scene_set.json``.
    """

    def __init__(self, path: Path, header: SceneSetFile) -> None:
        self.path, self.header = path, header
        self._assets = SceneAssets(lambda: self.library)
        self._kept: set[str] = set()

    @classmethod
    def open(cls, path: Path | str) -> "SceneSet":
        """Open an existing folder of scenes.

        Raises:
            MissingFileError: There is no such folder, or it holds no scene set.
            InvalidFileError: Its header is damaged.
        """
        path = Path(path)
        if not (path / HEADER).is_file():
            raise MissingFileError("scene set", path, "make one with: clutter6d generate --track sparse --out FOLDER")
        return cls(path, read_model(path / HEADER, SceneSetFile, what="scene set"))

    @classmethod
    def create(cls, path: Path, header: SceneSetFile) -> "SceneSet":
        """Start a folder of scenes, or go on with one made from the same track, seed and library.

        Raises:
            InvalidValueError: The folder holds something else.
            StorageError: It cannot be written.
        """
        if (path / HEADER).exists():
            existing = cls.open(path)
            differing = [
                name for name in SceneSetFile.model_fields if getattr(existing.header, name) != getattr(header, name)
            ]
            if differing:
                raise InvalidValueError(
                    f"{path} holds scenes of another {', '.join(differing)}; choose another --out or remove the folder"
                )
        elif path.is_dir() and any(path.iterdir()):
            raise InvalidValueError(f"{path} is neither empty nor a scene set; choose another --out")
        write_model(path / HEADER, header)
        AssetLibrary.create(path / "library")
        return cls(path, header)

    @cached_property
    def library(self) -> AssetLibrary:
        """The assets of these scenes."""
        return AssetLibrary.open(self.path / "library")

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All scenes, by id; read once.

        Raises:
            InvalidFileError: A scene is damaged or not of this track, or there is none.
        """
        return self._scenes

    @cached_property
    def _scenes(self) -> tuple[Scene, ...]:
        files = sorted(self.path.glob("scenes/*/scene.json"))
        if not files:
            raise InvalidFileError(self.path, "holds no scenes; run the generation again")
        scenes = tuple(read_scene(file) for file in files)
        for file, scene in zip(files, scenes, strict=True):
            if scene.track != self.header.track or scene.scene_id != file.parent.name:
                raise InvalidFileError(file, f"holds scene {scene.scene_id} of track {scene.track}, out of place here")
        return scenes

    @property
    def sha256(self) -> str:
        """Hash over the bytes of all scene files; names the exact set in every table."""
        return self._sha256

    @cached_property
    def _sha256(self) -> str:
        files = {scene.scene_id: self.scene_folder(scene.scene_id) / "scene.json" for scene in self.scenes}
        return scenes_sha256({name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in files.items()})

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash.

        Raises:
            InvalidFileError: The library lacks one, or holds it damaged.
        """
        return self._assets.of(scene, self.scene_folder(scene.scene_id) / "scene.json")

    def scene_folder(self, scene_id: str) -> Path:
        """The folder of one scene."""
        return self.path / "scenes" / scene_id

    def add(self, scene: Scene, assets: Mapping[str, Asset], record: GenerationRecord) -> None:
        """Store a scene with its assets; the scene's file last, so that what is there is whole."""
        for asset in (asset for key, asset in assets.items() if key not in self._kept):
            self.library.add(asset)
        self._kept.update(assets)
        folder = self.scene_folder(scene.scene_id)
        write_model(folder / "generation.json", record)
        write_scene(folder / "scene.json", scene)

    def record(self, scene_id: str) -> GenerationRecord:
        """What it took to make one scene."""
        return read_model(self.scene_folder(scene_id) / "generation.json", GenerationRecord, what="generation record")

    def failures(self) -> Counter[str]:
        """Failed attempts and states of all scenes by reason."""
        total: Counter[str] = Counter()
        for scene in self.scenes:
            total.update(self.record(scene.scene_id).failures)
        return total

    def certificates(self) -> pd.DataFrame:
        """One row a scene: its certificate."""
        names = type(self.scenes[0].certificate).__slots__
        rows = [{name: getattr(scene.certificate, name) for name in names} for scene in self.scenes]
        return pd.DataFrame(rows, index=pd.Index([scene.scene_id for scene in self.scenes], name="scene_id"))
