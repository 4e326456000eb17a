"""A design is what a family draws: pieces of known material. Finished, it is a shape with known mass and inertia."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Float64

from clutter6d.assets.asset import Mesh, VisualMesh
from clutter6d.assets.sources.base import RawShape
from clutter6d.assets.sources.procedural.outline import Number
from clutter6d.assets.sources.procedural.palette import Rgba, material, rgba
from clutter6d.assets.sources.procedural.solid import Shell, Solid, hull_mesh, on_grid, outer_surface
from clutter6d.assets.sources.procedural.symmetry import ASYMMETRIC, Symmetry

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Draw:
    """The random choices of one object."""

    rng: np.random.Generator

    def size(self, low: Number, high: Number) -> float:
        """A number between the two."""
        return float(self.rng.uniform(low, high))

    def count(self, low: int, high: int) -> int:
        """A whole number from low to high, both included."""
        return int(self.rng.integers(low, high + 1))

    def chance(self, probability: Number) -> bool:
        """Whether something is so."""
        return bool(self.rng.random() < probability)

    def one(self, *choices: T) -> T:
        """One of the choices, each as likely."""
        return choices[int(self.rng.integers(len(choices)))]

    def colour(self, name: str) -> str:
        """A natural colour of a material."""
        return self.one(*material(name).colours)


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A solid of one material and colour.

    Attributes:
        solid: Its body.
        material: A name of the palette's materials.
        colour: A name of the palette's colours.
        fill: Its mean density as a share of the material's: 1 is massive, an empty can is about 0.01.
        alpha: Opacity.
    """

    solid: Solid
    material: str
    colour: str
    fill: Number = 1.0
    alpha: Number = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """One object of a family: its pieces, the first of which gives it its material and colour.

    Where pieces overlap (a handle in its socket) both count in the mass.
    """

    pieces: tuple[Piece, ...]
    symmetry: Symmetry = ASYMMETRIC

    @property
    def longest_m(self) -> float:
        """The longest side of the bounding box."""
        points = [shell.vertices for piece in self.pieces for shell in piece.solid.shells]
        points += [part for piece in self.pieces for part in piece.solid.parts]
        stacked = np.concatenate(points)
        return float((stacked.max(axis=0) - stacked.min(axis=0)).max())

    def scaled_to(self, longest_m: Number) -> "Design":
        """The same object with its longest side as given."""
        factor = longest_m / self.longest_m
        return self._mapped(lambda solid: solid.stretch(factor, factor, factor))

    def turn(self, axis: str, degrees: Number) -> "Design":
        """The same object, rotated about an axis of the origin; its symmetry is declared for the result."""
        return self._mapped(lambda solid: solid.turn(axis, degrees))

    def weighing(self, lightest_kg: Number, heaviest_kg: Number) -> "Design":
        """The same object, its pieces made denser or hollowed alike if it would weigh less or more."""
        mass_kg = self.balance().mass_kg
        factor = min(max(mass_kg, lightest_kg), heaviest_kg) / mass_kg
        return replace(self, pieces=tuple(replace(piece, fill=piece.fill * factor) for piece in self.pieces))

    def balance(self) -> "Balance":
        """Mass and how it is spread."""
        moments = [
            _moments(shell) * (material(piece.material).density * piece.fill)
            for piece in self.pieces
            for shell in piece.solid.shells
        ]
        total = np.sum(moments, axis=0)
        mass, centre = total[0, 0], total[0, 1:] / total[0, 0]
        second = total[1:, 1:] / mass - np.outer(centre, centre)
        x, y, z = np.round(centre, 7) + 0.0
        return Balance(
            mass_kg=round(float(mass), 5),
            centre_m=(float(x), float(y), float(z)),
            inertia_per_kg=np.round(np.trace(second) * np.eye(3) - second, 12) + 0.0,
        )

    def shape(self) -> RawShape:
        """The finished shape."""
        balance = self.balance()
        volume_m3, visual = self._visual()
        return RawShape(
            visual=visual,
            parts=tuple(hull_mesh(part) for piece in self.pieces for part in piece.solid.parts),
            volume_m3=round(volume_m3, 12),
            centre_of_mass_m=balance.centre_m,
            inertia_per_kg=balance.inertia_per_kg,
            symmetry=self.symmetry.group(),
        )

    def _mapped(self, change: Callable[[Solid], Solid]) -> "Design":
        return replace(self, pieces=tuple(replace(piece, solid=change(piece.solid)) for piece in self.pieces))

    def _visual(self) -> tuple[float, tuple[VisualMesh, ...]]:
        """Volume, and what can be seen from outside, by colour."""
        coloured = [(rgba(piece.colour, piece.alpha), shell) for piece in self.pieces for shell in piece.solid.shells]
        volume_m3, visible = outer_surface([shell for _, shell in coloured])
        by_colour: dict[Rgba, list[Shell]] = {}
        for (colour, _), shell in zip(coloured, visible, strict=True):
            if len(shell.faces):
                by_colour.setdefault(colour, []).append(shell)
        visual = [VisualMesh(mesh=_joined(shells), rgba=colour) for colour, shells in by_colour.items()]
        return volume_m3, tuple(visual)


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Balance:
    """Mass, centre of mass, and inertia about it for 1 kg [m^2]."""

    mass_kg: float
    centre_m: tuple[float, float, float]
    inertia_per_kg: Float64[np.ndarray, "3 3"]


def _joined(shells: Sequence[Shell]) -> Mesh:
    starts = np.cumsum([0, *(len(shell.vertices) for shell in shells[:-1])])
    return Mesh(
        vertices=on_grid(np.concatenate([shell.vertices for shell in shells])).astype(np.float32),
        faces=np.concatenate([shell.faces + start for shell, start in zip(shells, starts, strict=True)]).astype(
            np.int32
        ),
    )


def _moments(shell: Shell) -> Float64[np.ndarray, "4 4"]:
    """Volume integrals of the products of (1, x, y, z): volume, first and second moments in one matrix."""
    corners = shell.vertices[shell.faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    six_volumes = (a * np.cross(b, c)).sum(axis=1)
    total = corners.sum(axis=1)
    first = (six_volumes[:, None] * total).sum(axis=0) / 24
    products = total[:, :, None] * total[:, None, :] + (corners[:, :, :, None] * corners[:, :, None, :]).sum(axis=1)
    result = np.empty((4, 4))
    result[0, 0] = six_volumes.sum() / 6
    result[0, 1:] = result[1:, 0] = first
    result[1:, 1:] = (six_volumes[:, None, None] * products).sum(axis=0) / 120
    return result
