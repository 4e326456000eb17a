"""The robot's look: smooth shells of our own design, or MuJoCo Menagerie's meshes when they are already on the machine.

Each shell is the convex hull of a few round-edged discs, so a link is a handful of discs. Nothing here collides or
weighs anything.
"""

from collections.abc import Mapping
from typing import NamedTuple

import mujoco
import numpy as np
from jaxtyping import Float64
from scipy.spatial import ConvexHull

from clutter6d.physics import VISUAL_GROUP
from clutter6d.sim.menagerie import add_menagerie_visuals

Vector = tuple[float, float, float]
Colour = tuple[float, float, float, float]

WHITE: Colour = (0.93, 0.94, 0.95, 1.0)
GREY: Colour = (0.72, 0.74, 0.76, 1.0)
DARK: Colour = (0.16, 0.17, 0.19, 1.0)
BLUE: Colour = (0.20, 0.45, 0.78, 1.0)

_X, _Y, _Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class Disc(NamedTuple):
    """A cylinder with rounded edges, in its link's frame [m]."""

    centre: Vector
    axis: Vector
    radius: float
    half_length: float
    fillet: float = 0.008


class Slab(NamedTuple):
    """A box with rounded edges, in its link's frame [m]."""

    centre: Vector
    half: Vector
    fillet: float = 0.006


class Shell(NamedTuple):
    """The convex hull of some solids, in one colour."""

    rgba: Colour
    solids: tuple[Disc | Slab, ...]


def _finger_shells(side: int) -> tuple[Shell, Shell]:
    carriage = Slab((0, side * 0.0145, 0.068), (0.0105, 0.0135, 0.010), 0.003)
    knuckle = Slab((0, side * 0.014, 0.077), (0.010, 0.012, 0.006))
    tip = Slab((0, side * 0.008, 0.105), (0.0088, 0.007, 0.005), 0.002)
    return Shell(GREY, (carriage,)), Shell(GREY, (knuckle, tip))


SHELLS: Mapping[str, tuple[Shell, ...]] = {
    "fr3_link0": (
        Shell(WHITE, (Disc((-0.01, 0, 0.012), _Z, 0.088, 0.012), Disc((0, 0, 0.115), _Z, 0.066, 0.018, 0.012))),
        Shell(WHITE, (Slab((-0.10, 0, 0.035), (0.045, 0.055, 0.033)), Disc((-0.01, 0, 0.06), _Z, 0.066, 0.03))),
        Shell(DARK, (Slab((-0.135, 0, 0.035), (0.013, 0.045, 0.025)),)),
        Shell(DARK, (Disc((0, 0, 0.137), _Z, 0.058, 0.006, 0.002),)),
    ),
    "fr3_link1": (
        Shell(WHITE, (Disc((0, 0, -0.158), _Z, 0.0625, 0.031, 0.006), Disc((0, 0, -0.09), _Z, 0.0605, 0.01))),
        Shell(WHITE, (Disc((0, 0, -0.09), _Z, 0.0605, 0.01), Disc((0, 0, 0), _Y, 0.0565, 0.044, 0.012))),
    ),
    "fr3_link2": (
        Shell(WHITE, (Disc((0, 0, 0.060), _Z, 0.0605, 0.018, 0.010), Disc((0, -0.100, 0.012), _Y, 0.0480, 0.010))),
        Shell(WHITE, (Disc((0, 0, -0.060), _Z, 0.0605, 0.018, 0.010), Disc((0, -0.100, -0.012), _Y, 0.0480, 0.010))),
        Shell(WHITE, (Disc((0, 0, 0), _Z, 0.0585, 0.060, 0.004), Disc((0, -0.110, 0), _Y, 0.0600, 0.010))),
        Shell(WHITE, (Disc((0, -0.110, 0), _Y, 0.0600, 0.012, 0.006), Disc((0, -0.168, 0), _Y, 0.0625, 0.024, 0.006))),
        Shell(DARK, (Disc((0, 0, 0.043), _Z, 0.0592, 0.0035, 0.001),)),
        Shell(DARK, (Disc((0, 0, -0.043), _Z, 0.0592, 0.0035, 0.001),)),
        Shell(DARK, (Disc((0, -0.195, 0), _Y, 0.057, 0.006, 0.002),)),
    ),
    "fr3_link3": (
        Shell(WHITE, (Disc((0, 0, -0.090), _Z, 0.0625, 0.026, 0.006), Disc((0.006, 0, -0.05), _Z, 0.0600, 0.012))),
        Shell(WHITE, (Disc((0.006, 0, -0.05), _Z, 0.0600, 0.012), Disc((0.0825, 0, 0), _Y, 0.0530, 0.042, 0.012))),
    ),
    "fr3_link4": (
        Shell(WHITE, (Disc((0, 0, 0.054), _Z, 0.0565, 0.017, 0.009), Disc((-0.068, 0.078, 0.012), _Y, 0.044, 0.012))),
        Shell(WHITE, (Disc((0, 0, -0.054), _Z, 0.0565, 0.017, 0.009), Disc((-0.068, 0.078, -0.012), _Y, 0.044, 0.012))),
        Shell(WHITE, (Disc((0, 0, 0), _Z, 0.0545, 0.054, 0.004), Disc((-0.074, 0.084, 0), _Y, 0.056, 0.012))),
        Shell(WHITE, (Disc((-0.074, 0.080, 0), _Y, 0.056, 0.010), Disc((-0.0825, 0.106, 0), _Y, 0.060, 0.018, 0.006))),
        Shell(DARK, (Disc((0, 0, 0.038), _Z, 0.0552, 0.0035, 0.001),)),
        Shell(DARK, (Disc((0, 0, -0.038), _Z, 0.0552, 0.0035, 0.001),)),
        Shell(DARK, (Disc((-0.0825, 0.127, 0), _Y, 0.054, 0.005, 0.002),)),
    ),
    "fr3_link5": (
        Shell(WHITE, (Disc((0, 0, -0.232), _Z, 0.060, 0.020, 0.006), Disc((0, 0.012, -0.190), _Z, 0.056, 0.012))),
        Shell(WHITE, (Disc((0, 0.012, -0.190), _Z, 0.056, 0.012), Disc((0, 0.062, -0.10), _Z, 0.036, 0.012))),
        Shell(WHITE, (Disc((0, 0.062, -0.10), _Z, 0.036, 0.012), Disc((0, 0.070, 0), _Y, 0.049, 0.018, 0.010))),
        Shell(DARK, (Disc((0, 0.049, 0), _Y, 0.045, 0.005, 0.002),)),
    ),
    "fr3_link6": (
        Shell(WHITE, (Disc((0, 0, 0), _Z, 0.050, 0.042, 0.010), Disc((0.035, 0, 0), _Z, 0.042, 0.034, 0.010))),
        Shell(WHITE, (Disc((0.025, 0, 0), _Z, 0.044, 0.036, 0.010), Disc((0.088, -0.002, 0), _Y, 0.049, 0.040, 0.012))),
        Shell(BLUE, (Disc((0.088, 0.040, 0), _Y, 0.012, 0.003, 0.001),)),
        Shell(DARK, (Disc((0.088, -0.043, 0), _Y, 0.043, 0.004, 0.002),)),
    ),
    "fr3_link7": (
        Shell(WHITE, (Disc((0, 0, 0.066), _Z, 0.046, 0.019, 0.006), Disc((0.030, 0, 0.074), _Z, 0.038, 0.012))),
        Shell(DARK, (Disc((0, 0, 0.090), _Z, 0.040, 0.006, 0.002),)),
        Shell(GREY, (Disc((0, 0, 0.101), _Z, 0.0315, 0.006, 0.001),)),
    ),
    "hand": (
        Shell(WHITE, (Slab((0, 0, 0.030), (0.029, 0.100, 0.028), 0.012), Disc((0, 0, 0.012), _Z, 0.032, 0.010))),
        Shell(DARK, (Slab((0, 0, 0.0585), (0.018, 0.090, 0.0055), 0.003),)),
        *_finger_shells(1),
        *_finger_shells(-1),
        Shell(DARK, (Slab((0, 0, 0.1025), (0.0092, 0.0068, 0.0094), 0.002),)),
    ),
}  # fmt: skip
"""What the robot looks like, by body."""

_AROUND = np.linspace(0, 2 * np.pi, 72, endpoint=False)
_ROUND = np.linspace(0, np.pi / 2, 5)


def add_visuals(spec: mujoco.MjSpec, bodies: Mapping[str, mujoco.MjsBody]) -> None:
    """Add visual geometry to the robot's bodies: Menagerie's for those it has on this machine, else our own."""
    dressed = add_menagerie_visuals(spec, bodies)
    for name, shells in SHELLS.items():
        if name in dressed:
            continue
        for index, shell in enumerate(shells):
            _add_shell(spec, bodies[name], f"{name}_visual{index}", shell)


def _add_shell(spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, shell: Shell) -> None:
    vertices, faces = shell_mesh(shell)
    mesh = spec.add_mesh(name=name)
    mesh.uservert = vertices.astype(np.float32).ravel()
    mesh.userface = faces.astype(np.int32).ravel()
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        rgba=shell.rgba,
        group=VISUAL_GROUP,
        contype=0,
        conaffinity=0,
        mass=0,
    )


def shell_mesh(shell: Shell) -> tuple[Float64[np.ndarray, "vertex 3"], np.ndarray]:
    """Vertices and outward faces of a shell."""
    points = np.concatenate([_slab(s) if isinstance(s, Slab) else _disc(s) for s in shell.solids])
    hull = ConvexHull(points)
    used, faces = np.unique(hull.simplices, return_inverse=True)
    vertices, faces = points[used], faces.reshape(-1, 3)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return vertices, faces


def _disc(disc: Disc) -> Float64[np.ndarray, "point 3"]:
    rings: list[np.ndarray] = []
    for angle in _ROUND:
        radius = disc.radius - disc.fillet * (1 - np.cos(angle))
        height = disc.half_length - disc.fillet * (1 - np.sin(angle))
        for sign in (1, -1):
            ring = (radius * np.cos(_AROUND), radius * np.sin(_AROUND), np.full_like(_AROUND, sign * height))
            rings.append(np.stack(ring, axis=-1))
    shift = {_X: 1, _Y: 2, _Z: 0}[disc.axis]
    return np.roll(np.concatenate(rings), shift, axis=1) + disc.centre


def _slab(slab: Slab) -> Float64[np.ndarray, "point 3"]:
    inner = np.array(slab.half) - slab.fillet
    longitude, latitude = np.meshgrid(np.linspace(0, np.pi / 2, 5), np.linspace(0, np.pi / 2, 5))
    octant = np.stack(
        [np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)], axis=-1
    ).reshape(-1, 3)
    corner = inner + slab.fillet * octant
    signs = np.stack(np.meshgrid(*[[-1, 1]] * 3), axis=-1).reshape(-1, 1, 3)
    return (signs * corner).reshape(-1, 3) + slab.centre
