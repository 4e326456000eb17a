"""Scenes by name or by path: what every command's ``--scenes`` means."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from clutter6d.assets.asset import Asset
from clutter6d.dataset.dataset import DEFAULT_DATASET, dataset_names, open_dataset
from clutter6d.dataset.split import Split
from clutter6d.errors import MissingFileError, UnknownNameError, UserError
from clutter6d.scene import Scene
from clutter6d.scenegen.scene_set import HEADER, SceneSet

_HINT = "make one with: clutter6d generate --track sparse --out FOLDER"


@runtime_checkable
class SceneCollection(Protocol):
    """Scenes with their assets: a folder of scenes, or a frozen split."""

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All scenes, by id."""
        ...

    @property
    def sha256(self) -> str:
        """Names exactly this set of scenes."""
        ...

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash."""
        ...


def load_split(name: str) -> Split:
    """A frozen split; nothing but its index is read before it is asked for.

    Args:
        name: A split of Clutter6D v1, such as ``"moderate-test"``, or of another data set, with that data set's name
            or folder before it: ``"clutter6d-real-v1/dense-test"``.

    Raises:
        UnknownNameError: There is no such split.
        InvalidFileError: Its file is not the one that was frozen.
    """
    dataset, _, split = name.rpartition("/")
    return open_dataset(dataset or DEFAULT_DATASET).split(split)


def open_scenes(name_or_folder: str | Path) -> SceneSet | Split:
    """The scenes of a folder made by ``clutter6d generate``, or of a frozen split.

    Raises:
        MissingFileError: A folder without scenes, or an absolute path with nothing there.
        UnknownNameError: Neither a folder nor a split's name.
        InvalidFileError: What is there is damaged.
    """
    folder = Path(name_or_folder)
    if (folder / HEADER).is_file():
        return SceneSet.open(folder)
    if folder.is_dir():
        raise MissingFileError("scene set", folder, _HINT)
    try:
        return load_split(str(name_or_folder))
    except UnknownNameError:
        if folder.is_absolute():
            raise MissingFileError("scene set", folder, _HINT) from None
        raise UnknownNameError("folder of scenes or split", str(name_or_folder), split_names()) from None


def find_scenes(where: str | Path) -> tuple[SceneSet | Split, Sequence[Scene]]:
    """The scenes that an argument means, and the collection they belong to.

    Args:
        where: A folder of scenes, the folder ``scenes/<scene_id>`` of one scene in it, a split's name, or a split's
            name and a scene id: ``"dense-test/dense-2-00003"``.

    Raises:
        UnknownNameError: It is none of them.
        InvalidFileError: What is there is damaged.
    """
    folder = Path(where)
    if (folder / "scene.json").is_file():
        scene_set, name = SceneSet.open(folder.resolve().parent.parent), folder.resolve().name
        return scene_set, [scene for scene in scene_set.scenes if scene.scene_id == name]
    name, _, scene_id = str(where).rpartition("/")
    split = None if folder.exists() else _split_or_none(name)
    if split is not None:
        return split, [split[scene_id]]
    scenes = open_scenes(where)
    return scenes, scenes.scenes


def _split_or_none(name: str) -> Split | None:
    try:
        return load_split(name)
    except UserError:
        return None


def split_names() -> tuple[str, ...]:
    """All splits that come with this package, as :func:`load_split` takes them."""
    names: list[str] = []
    for dataset in dataset_names():
        prefix = "" if dataset == DEFAULT_DATASET else f"{dataset}/"
        names += [f"{prefix}{split}" for split in open_dataset(dataset).split_names]
    return tuple(names)
