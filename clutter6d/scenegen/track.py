"""Difficulty tracks: how many objects, and where they may stand (paper, Table "Difficulty levels")."""

from dataclasses import dataclass

from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.scene import TABLE_SIZE_M, Relation


@dataclass(frozen=True, kw_only=True, slots=True)
class Region:
    """A rectangle on the table, world frame, metres: allowed positions of an object's centre."""

    x: tuple[float, float]
    y: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse an empty rectangle or one that leaves the table."""
        for (low, high), side in zip((self.x, self.y), TABLE_SIZE_M, strict=True):
            if not -side / 2 <= low < high <= side / 2:
                raise InvalidValueError(f"region [{low}, {high}] m is empty or leaves the table (+-{side / 2} m)")


@dataclass(frozen=True, kw_only=True, slots=True)
class Track:
    """One difficulty level. To add one, add it to ``TRACKS``.

    Attributes:
        name: Name on the command line.
        large_obstacles: Obstacles with a longest extent in [0.25, 0.35] m.
        small_obstacles: Obstacles with a longest extent in [0.06, 0.25) m.
        target_region: Where the target starts and ends; the paper's.
        clutter_region: Where obstacles stand. The paper is silent. Ours reaches 0.08 m beyond the target's region on
            every side, so that every obstacle stands in the target's way or beside it.
        goal_pairs: Tasks per scene.
        min_displacement_m: Planar distance from initial to goal position, at least; the paper's.
        min_gap_m: Free distance between any two footprints at the start.
        goal_relations: Relations the target must fulfil at every goal, with obstacles named ``large_0``, ``small_0``.
    """

    name: str
    large_obstacles: int
    small_obstacles: int
    target_region: Region = Region(x=(-0.15, 0.15), y=(-0.30, 0.30))
    clutter_region: Region = Region(x=(-0.23, 0.23), y=(-0.38, 0.38))
    goal_pairs: int = 16
    min_displacement_m: float = 0.15
    min_gap_m: float = 0.005
    goal_relations: tuple[Relation, ...] = ()

    @property
    def object_count(self) -> int:
        """All objects, the target included."""
        return 1 + self.large_obstacles + self.small_obstacles

    @property
    def obstacle_names(self) -> tuple[str, ...]:
        """Names of the obstacles, large ones first."""
        large = tuple(f"large_{index}" for index in range(self.large_obstacles))
        return large + tuple(f"small_{index}" for index in range(self.small_obstacles))


TRACKS = {
    track.name: track
    for track in (
        Track(name="sparse", large_obstacles=1, small_obstacles=2),
        Track(name="moderate", large_obstacles=3, small_obstacles=4),
        Track(name="dense", large_obstacles=5, small_obstacles=6),
    )
}


def find_track(name: str) -> Track:
    """The track of a name.

    Raises:
        UnknownNameError: There is none.
    """
    if name not in TRACKS:
        raise UnknownNameError("track", name, TRACKS)
    return TRACKS[name]
