"""An asset library of boxes on disk, made in code, for tests that need no real meshes."""

from pathlib import Path

from clutter6d.assets.library import AssetLibrary
from clutter6d.seeding import generator
from tests.scene_fixtures import make_box_asset


def make_box_library(path: Path, *, large: int = 8, small: int = 12, name: str = "box") -> AssetLibrary:
    """Boxes of both cohorts with drawn proportions and masses."""
    library = AssetLibrary.create(path)
    rng = generator(0, "box library" if name == "box" else name)
    for index in range(large + small):
        longest = rng.uniform(0.25, 0.32) if index < large else rng.uniform(0.07, 0.16)
        size = (float(longest), float(longest * rng.uniform(0.3, 0.8)), float(longest * rng.uniform(0.3, 0.6)))
        library.add(make_box_asset(f"{name}-{index:03d}", size, mass_kg=float(rng.uniform(0.1, 1.0))))
    return library
