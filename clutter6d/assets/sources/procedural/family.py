"""A family: one kind of object, drawn without end from a seed."""

from collections.abc import Callable
from dataclasses import dataclass

from clutter6d.assets.sources.procedural.design import Design, Draw
from clutter6d.seeding import generator

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Family:
    """One kind of object.

    Attributes:
        name: The kind; also the objects' category.
        draw: Draws one object in natural proportions; it is scaled afterwards.
        small: Range of the longest side [m] of its small objects, if there are any.
        large: The same of its large objects; a family that has both alternates.
    """

    name: str
    draw: Callable[[Draw], Design]
    small: Range | None
    large: Range | None

    def design(self, seed: int, index: int) -> Design:
        """The family's object of some index; depends on nothing but the arguments."""
        draw = Draw(generator(seed, "procedural", self.name, index))
        ranges = [sizes for sizes in (self.small, self.large) if sizes is not None]
        longest_m = draw.size(*ranges[index % len(ranges)])
        return self.draw(draw).scaled_to(longest_m)


def family(*, small: Range | None = None, large: Range | None = None) -> Callable[[Callable[[Draw], Design]], Family]:
    """Make a family of a drawing function, which gives it its name."""

    def decorate(draw: Callable[[Draw], Design]) -> Family:
        return Family(draw.__name__.replace("_", "-"), draw, small, large)

    return decorate
