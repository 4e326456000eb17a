"""A frozen split: scenes and their assets, read when they are needed."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from clutter6d.assets.asset import Asset
from clutter6d.assets.collection import AssetCollection
from clutter6d.dataset.manifest import SplitEntry
from clutter6d.dataset.split_file import SplitFile
from clutter6d.errors import UnknownNameError
from clutter6d.geometry import rotation_error_rad
from clutter6d.scene import Scene
from clutter6d.scenegen.scene_assets import SceneAssets

if TYPE_CHECKING:
    import pandas as pd


class Split:
    """Scenes of a frozen data set; index it by position or by scene id.

    Args:
        path: Its Parquet file.
        entry: What the manifest says of it.
        assets: Where the assets of its scenes are.
    """

    def __init__(self, path: Path, entry: SplitEntry, assets: AssetCollection) -> None:
        self.path, self.entry = path, entry
        self._file, self._collection = SplitFile(path), assets
        self._assets = SceneAssets(lambda: self._collection)
        self._scenes: dict[int, Scene] = {}

    @property
    def name(self) -> str:
        """Its name, for instance ``"moderate-test"``."""
        return self.entry.name

    @property
    def sha256(self) -> str:
        """Names exactly this set of scenes; the same as that of a folder of the same scenes."""
        return self.entry.scenes_sha256

    @property
    def content(self) -> bytes:
        """The file's bytes."""
        return self._file.content

    @property
    def scene_ids(self) -> tuple[str, ...]:
        """Names of all scenes."""
        return self._file.scene_ids

    @property
    def scene_sha256(self) -> Mapping[str, str]:
        """The stored hash of each scene, by id."""
        return self._file.scene_sha256

    @property
    def assets(self) -> AssetCollection:
        """Where the assets of its scenes are."""
        return self._collection

    def __len__(self) -> int:
        """Number of scenes."""
        return len(self.scene_ids)

    def __getitem__(self, key: int | str) -> Scene:
        """One scene, by position or id.

        Raises:
            UnknownNameError: There is no scene of that id.
            IndexError: There is no scene at that position.
            InvalidFileError: The scene is damaged.
        """
        if isinstance(key, str):
            if key not in self._file.scene_sha256:
                raise UnknownNameError(f"scene of {self.name}", key, self.scene_ids)
            key = self.scene_ids.index(key)
        index = range(len(self))[key]
        if index not in self._scenes:
            self._scenes[index] = self._file.read(index)
        return self._scenes[index]

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """All scenes, by id; each is read once."""
        return self._all

    @cached_property
    def _all(self) -> tuple[Scene, ...]:
        return tuple(self[index] for index in range(len(self)))

    def assets_of(self, scene: Scene) -> Mapping[str, Asset]:
        """The assets of a scene by content hash.

        Raises:
            InvalidFileError: One is missing, damaged or does not fit the scene.
        """
        return self._assets.of(scene, self.path)

    def failures(self) -> tuple[dict[str, int], ...]:
        """Draws and states that were discarded for each scene, by reason."""
        return self._file.failures()

    def to_pandas(self) -> "pd.DataFrame":
        """One row a goal pair: scene, target, poses [m, wxyz], distances [m, rad], and what makes it hard."""
        import pandas as pd

        rows: list[dict[str, object]] = []
        for scene in self.scenes:
            shared = {"scene_id": scene.scene_id, "track": scene.track, "objects": len(scene.objects)}
            for number, pair in enumerate(scene.goal_pairs):
                initial, goal = pair.initial.as_row(), pair.goal.as_row()
                rows.append(
                    {
                        **shared,
                        "pair": number,
                        "target": scene.target.asset_name,
                        "target_hash": scene.target.asset_hash,
                        **{f"initial_{axis}": value for axis, value in zip(_POSE, initial, strict=True)},
                        **{f"goal_{axis}": value for axis, value in zip(_POSE, goal, strict=True)},
                        "planar_displacement_m": pair.planar_displacement_m,
                        "rotation_rad": float(rotation_error_rad(initial[3:], goal[3:])),
                        "is_path_blocked": pair.is_path_blocked,
                        "changes_resting_face": pair.changes_resting_face,
                    }
                )
        return pd.DataFrame(rows)


_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")
