"""A family: one kind of object, drawn without end from a seed."""

from collections.abc import Callable
from dataclasses import dataclass

from clutter6d.assets.asset import SMALL_EXTENT_M
from clutter6d.assets.sources.procedural.design import Design, Draw
from clutter6d.seeding import generator

Range = tuple[float, float]

LARGE_SHARE = 2 / 3
"""Share of large objects in a family that has both, which makes about four tenths of all objects large."""

LIGHTEST_KG = 0.02
"""Below this, contacts at the simulator's step are no longer stiff and calm at once."""

HEAVIEST_KG = (1.8, 3.0)
"""The range from which the mass is drawn above which an object is made hollow: the arm has to push it."""


@dataclass(frozen=True, slots=True)
class Family:
    """One kind of object.

    Attributes:
        name: The kind; also the objects' category.
        draw: Draws one object in natural proportions; it is scaled afterwards.
        small: Range of the longest side [m] of its small objects, if there are any.
        large: The same of its large objects; a family that has both draws which.
    """

    name: str
    draw: Callable[[Draw], Design]
    small: Range | None
    large: Range | None

    def design(self, seed: int, index: int) -> Design:
        """The family's object of some index; depends on nothing but the arguments."""
        draw = Draw(generator(seed, "procedural", self.name, index))
        is_large = draw.chance(LARGE_SHARE)
        first, second = (self.large, self.small) if is_large else (self.small, self.large)
        longest_m = draw.size(*(first or second or SMALL_EXTENT_M))
        heaviest_kg = draw.size(*HEAVIEST_KG)
        return self.draw(draw).scaled_to(longest_m).weighing(LIGHTEST_KG, heaviest_kg)


def family(*, small: Range | None = None, large: Range | None = None) -> Callable[[Callable[[Draw], Design]], Family]:
    """Make a family of a drawing function, which gives it its name."""

    def decorate(draw: Callable[[Draw], Design]) -> Family:
        return Family(draw.__name__.replace("_", "-"), draw, small, large)

    return decorate
