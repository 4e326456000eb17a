"""What stands on a laid table."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.primitives import bar, box, cup, disc, lathe, slab
from clutter6d.assets.sources.procedural.solid import Solid, weld
from clutter6d.assets.sources.procedural.symmetry import TURNED


def ear(radius: float, low: float, high: float, reach: float, size: float) -> Solid:
    """A handle on the side of a vessel of some radius, in the plane of x and z."""
    inside = radius - size / 2
    path = [(inside, 0, high), (radius + reach, 0, high), (radius + reach * 0.9, 0, low), (inside, 0, low)]
    return bar(path, size * 1.3, size, rounding=reach * 0.45)


@family(small=(0.085, 0.14))
def mug(draw: Draw) -> Design:
    """A mug with a handle."""
    radius, height, wall = draw.size(0.036, 0.046), draw.size(0.075, 0.11), draw.size(0.004, 0.006)
    foot = radius * draw.size(0.78, 1.0)
    body = cup([(foot, 0), (radius, height * 0.25), (radius, height)], wall=wall, floor=0.008, sectors=8)
    handle = ear(radius, height * 0.22, height * 0.8, draw.size(0.022, 0.03), 0.011)
    colour = draw.colour("ceramic")
    return Design((Piece(body, "ceramic", colour), Piece(handle, "ceramic", draw.one(colour, colour, "white"))))


@family(small=(0.1, 0.18), large=(0.25, 0.32))
def bowl(draw: Draw) -> Design:
    """A bowl with a foot ring."""
    radius, foot, height = 0.08, draw.size(0.035, 0.048), draw.size(0.05, 0.075)
    made_of = draw.one("ceramic", "ceramic", "wood", "steel")
    belly = (radius * draw.size(0.82, 0.9), height * draw.size(0.4, 0.5))
    body = cup([(foot, 0.004), belly, (radius, height)], wall=0.006, floor=0.012, sectors=10)
    base = disc(foot * 0.85, 0.008)
    colour = draw.colour(made_of)
    return Design((Piece(body, made_of, colour), Piece(base, made_of, colour)), TURNED)


@family(small=(0.15, 0.22), large=(0.25, 0.3))
def plate(draw: Draw) -> Design:
    """A flat plate with a raised rim."""
    well, depth = draw.size(0.07, 0.085), draw.size(0.012, 0.022)
    made_of = draw.one("ceramic", "ceramic", "wood", "plastic")
    body = cup([(well, 0), (0.115, depth)], wall=0.006, floor=0.006, sectors=12)
    return Design((Piece(body, made_of, draw.colour(made_of)),), TURNED)


@family(small=(0.16, 0.24), large=(0.25, 0.3))
def teapot(draw: Draw) -> Design:
    """A round-bellied teapot with spout, handle and a knob on the lid."""
    radius, height = draw.size(0.058, 0.07), draw.size(0.085, 0.11)
    top = radius * 0.55
    profile = [(radius * 0.6, 0), (radius, height * 0.3), (radius * 0.96, height * 0.62), (top, height)]
    body = lathe(profile, rounding=0.03)
    spout_path = [(radius * 0.75, 0, height * 0.25), (radius * 1.35, 0, height * 0.5), (radius * 1.75, 0, height * 1.0)]
    spout = bar(spout_path, [0.03, 0.022, 0.014])
    handle = ear(radius * 0.85, height * 0.2, height * 0.85, radius * 0.75, 0.011).turn("z", 180)
    lid = lathe([(top * 0.95, height * 0.98), (top * 0.6, height * 1.1), (0.006, height * 1.12)], rounding=0.01)
    knob = lathe([(0.005, 0), (0.011, 0.009), (0.008, 0.018)], rounding=0.005).at(z=height * 1.1)
    colour = draw.colour("ceramic")
    second = draw.one(colour, draw.colour("ceramic"))
    parts = (
        (body, "ceramic", colour, 0.4),
        (spout + handle, "ceramic", colour, 0.7),
        (lid + knob, "ceramic", second, 0.5),
    )
    return Design(tuple(Piece(*part) for part in parts))


def cutlery_handle(length: float, width: float, thickness: float) -> Solid:
    """A flat handle along -x, slightly waisted and arched, its end at the origin."""
    path = [(-length, 0, 0.004), (-length * 0.55, 0, 0.008), (-0.01, 0, 0.006), (0.004, 0, 0.004)]
    return bar(path, [width, width * 0.8, width * 0.42, width * 0.42], thickness, square=True)


def cutlery_look(draw: Draw) -> tuple[str, str, float]:
    """Material, colour and thickness of one piece of cutlery."""
    made_of = draw.one("steel", "steel", "wood", "plastic")
    return made_of, draw.colour(made_of), draw.size(0.003, 0.004) if made_of == "steel" else draw.size(0.005, 0.007)


@family(small=(0.14, 0.22), large=(0.25, 0.34))
def spoon(draw: Draw) -> Design:
    """A spoon, from teaspoon to wooden cooking spoon."""
    made_of, colour, thickness = cutlery_look(draw)
    dish = cup([(0.012, 0), (0.02, 0.009)], wall=0.0035, floor=0.003, sectors=8).stretch(draw.size(1.3, 1.6))
    handle = cutlery_handle(draw.size(0.11, 0.14), draw.size(0.016, 0.02), thickness).at(x=-0.024, z=0.003)
    return Design((Piece(dish + handle, made_of, colour),))


@family(small=(0.15, 0.21))
def fork(draw: Draw) -> Design:
    """A fork with three or four tines."""
    made_of, colour, thickness = cutlery_look(draw)
    tines, width = draw.count(3, 4), draw.size(0.022, 0.026)
    palm = slab(
        [
            (0.024, -width / 2),
            (0.024, width / 2),
            (0.008, width / 2),
            (-0.006, 0.004),
            (-0.006, -0.004),
            (0.008, -width / 2),
        ],
        thickness,
    )
    tooth = bar([(0.02, 0, 0), (0.045, 0, -0.001), (0.066, 0, 0.004)], [0.0038, 0.0038, 0.002], thickness, square=True)
    spread = [(i / (tines - 1) - 0.5) * (width - 0.004) for i in range(tines)]
    teeth = weld([tooth.at(y=y, z=0.006) for y in spread])
    handle = cutlery_handle(draw.size(0.1, 0.125), draw.size(0.015, 0.019), thickness)
    return Design((Piece(handle + palm.at(z=0.0045) + teeth, made_of, colour),))


@family(small=(0.18, 0.24), large=(0.25, 0.33))
def knife(draw: Draw) -> Design:
    """A knife, from table knife to chef's knife."""
    length, width = draw.size(0.11, 0.17), draw.size(0.02, 0.038)
    edge = [
        (0, -width * 0.55),
        (length * 0.7, -width * 0.5),
        (length, width * 0.3),
        (length * 0.8, width * 0.45),
        (0, width * 0.45),
    ]
    blade = slab(edge, draw.size(0.0022, 0.003), rounding=0.006).at(z=0.006)
    handle = box(draw.size(0.095, 0.12), draw.size(0.02, 0.025), 0.016, rounding=0.006)
    reach = handle.shells[0].vertices[:, 0].max()
    bolster = box(0.012, 0.022, 0.014, rounding=0.003).at(x=0.001, z=0.001)
    made_of = draw.one("wood", "plastic", "plastic")
    grip = Piece(
        handle.at(x=-float(reach)),
        made_of,
        draw.one("black", "graphite", "red") if made_of == "plastic" else draw.colour("wood"),
    )
    return Design((grip, Piece(blade, "steel", "steel"), Piece(bolster, "steel", "steel")))
