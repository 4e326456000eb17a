"""What runs on current."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.primitives import bar, box, disc, lathe, slab
from clutter6d.assets.sources.procedural.solid import Solid, weld
from clutter6d.assets.sources.procedural.symmetry import TURNED

CASES = ("black", "graphite", "white", "grey", "navy", "red", "mint")


def keys(columns: int, rows: int, pitch_x: float, pitch_y: float, size: float, height: float) -> Solid:
    """A grid of square keys as one sheet of small shells over one convex part, centred, on z = 0."""
    key = box(pitch_x * size, pitch_y * size, height, rounding=height * 0.6)
    places = [
        ((i - (columns - 1) / 2) * pitch_x, (j - (rows - 1) / 2) * pitch_y) for i in range(columns) for j in range(rows)
    ]
    shells = tuple(key.at(x, y).shells[0] for x, y in places)
    return Solid(shells, box(columns * pitch_x, rows * pitch_y, height).parts)


@family(small=(0.14, 0.21))
def remote_control(draw: Draw) -> Design:
    """A remote control."""
    length, width, height = draw.size(0.15, 0.2), draw.size(0.038, 0.05), draw.size(0.014, 0.02)
    body = box(length, width, height, rounding=0.008)
    pad = keys(draw.count(4, 7), 3, 0.013, width * 0.27, 0.62, 0.0022).at(x=-length * 0.14, z=height - 0.0004)
    dial = disc(width * 0.3, 0.0025, rounding=0.001).at(x=length * 0.31, z=height - 0.0004)
    power = disc(0.0045, 0.003, rounding=0.001).at(x=length * 0.445, y=width * 0.3, z=height - 0.0004)
    case = draw.one("black", "graphite", "white", "grey")
    key_colour = "grey" if case != "grey" else "white"
    return Design(
        (
            Piece(body, "plastic", case, 0.75),
            Piece(pad + dial.seen_only(), "rubber", key_colour, 0.5),
            Piece(power.seen_only(), "rubber", "red", 0.5),
        )
    )


@family(small=(0.13, 0.18))
def phone(draw: Draw) -> Design:
    """A smartphone with its camera bump."""
    length, width = draw.size(0.14, 0.165), draw.size(0.068, 0.078)
    body = box(length, width, 0.0085, rounding=0.01)
    screen = box(length * 0.965, width * 0.93, 0.0012, rounding=0.008).at(z=0.0078)
    bump = box(0.032, 0.032, 0.0022, rounding=0.008).at(length * 0.35, width * 0.2, -0.0016)
    lens = disc(0.006, 0.0012, rounding=0.0004)
    lenses = lens.at(length * 0.35 - 0.007, width * 0.2 - 0.006, -0.0024) + lens.at(
        length * 0.35 + 0.007, width * 0.2 + 0.006, -0.0024
    )
    colour = draw.one("graphite", "white", "navy", "rose", "mint", "violet", "red")
    return Design(
        (
            Piece(body, "aluminium", colour, 0.8),
            Piece(screen.seen_only(), "glass", "black"),
            Piece(bump, "aluminium", colour),
            Piece(lenses.seen_only(), "glass", "black"),
        )
    )


@family(small=(0.1, 0.16))
def camera(draw: Draw) -> Design:
    """A camera with its lens."""
    x, y, z = draw.size(0.115, 0.135), draw.size(0.036, 0.046), draw.size(0.07, 0.082)
    body = box(x, y, z, rounding=0.008)
    band = box(x + 0.001, y + 0.001, z * 0.52, rounding=0.008).at(z=z * 0.22)
    radius = draw.size(0.027, 0.032)
    reach = draw.size(0.03, 0.055)
    barrel = lathe([(radius, 0), (radius, reach * 0.6), (radius * 0.9, reach)], rounding=0.003)
    glass = lathe([(radius * 0.72, reach - 0.001), (radius * 0.3, reach + 0.0035)], rounding=0.003)
    lens, front = (solid.turn("x", 90).at(y=-y / 2, z=z * 0.48) for solid in (barrel, glass))
    hump = (
        slab([(-0.022, 0), (0.022, 0), (0.014, 0.014), (-0.014, 0.014)], y * 0.8, rounding=0.003)
        .turn("x", 90)
        .at(y=y * 0.4, z=z - 0.001)
    )
    dials = disc(0.008, 0.006, rounding=0.001).at(x=x * 0.36, z=z - 0.001) + disc(0.01, 0.005, rounding=0.001).at(
        x=-x * 0.36, z=z - 0.001
    )
    colour = draw.one("black", "steel", "graphite", "cream", "red")
    leather = draw.one("black", "graphite", "brown", "navy") if colour != "black" else "graphite"
    pieces = (
        Piece(body + hump, "plastic", colour, 0.9),
        Piece(band.seen_only(), "leather", leather, 0.05),
        Piece(lens, "plastic", "black", 1.3),
        Piece(dials, "aluminium", "steel"),
        Piece(front, "glass", "indigo"),
    )
    return Design(pieces)


@family(small=(0.14, 0.18))
def game_controller(draw: Draw) -> Design:
    """A game controller with two grips."""
    plate = slab(
        [(-0.055, -0.012), (0.055, -0.012), (0.068, 0.018), (0.048, 0.036), (-0.048, 0.036), (-0.068, 0.018)],
        0.026,
        rounding=0.014,
    )
    spread = draw.size(0.012, 0.02)
    grip = bar(
        [(0.048, 0.02, 0.014), (0.06, -0.01, 0.013), (0.062 + spread, -0.055, 0.008)],
        [0.03, 0.034, 0.018],
        [0.038, 0.036, 0.022],
        side=(0, 0, 1),
    )
    stick = lathe([(0.006, 0), (0.006, 0.006), (0.0085, 0.0095)], rounding=0.001).at(z=0.0255)
    sticks = stick.at(0.022, -0.002) + stick.at(-0.022, -0.002)
    button = disc(0.0042, 0.003, rounding=0.001).at(z=0.0255)
    cross = box(0.02, 0.0065, 0.003, rounding=0.001) + box(0.0065, 0.02, 0.003, rounding=0.001)
    colour = draw.one("black", "white", "graphite", "red", "blue", "mint", "violet")
    dark = "black" if colour != "black" else "grey"
    places = ((0.044, 0.026, "green"), (0.044, 0.01, "red"), (0.052, 0.018, "blue"), (0.036, 0.018, "yellow"))
    pieces = [
        Piece(plate + grip + grip.stretch(x=-1), "plastic", colour, 0.75),
        Piece(sticks + cross.at(-0.044, 0.018, 0.0255).seen_only(), "rubber", dark),
    ]
    pieces += [Piece(button.at(x, y).seen_only(), "plastic", tone) for x, y, tone in places]
    return Design(tuple(pieces))


@family(small=(0.09, 0.13))
def computer_mouse(draw: Draw) -> Design:
    """A computer mouse."""
    outline = [
        (0.05, -0.018),
        (0.056, 0),
        (0.05, 0.018),
        (0.0, 0.03),
        (-0.045, 0.026),
        (-0.056, 0),
        (-0.045, -0.026),
        (0.0, -0.03),
    ]
    low = slab(outline, draw.size(0.012, 0.016), rounding=0.02)
    back = (
        lathe([(0.03, 0), (0.026, 0.012), (0.012, 0.02)], rounding=0.02)
        .stretch(1.55, 0.92, draw.size(0.85, 1.1))
        .at(x=-0.006, z=0.012)
    )
    wheel = disc(0.009, 0.006, rounding=0.001).turn("x", 90).at(0.032, 0.003, 0.0185)
    colour = draw.one(*CASES)
    return Design(
        (Piece(low + back, "plastic", colour, 0.7), Piece(wheel, "rubber", "grey" if colour != "grey" else "black"))
    )


@family(large=(0.27, 0.35))
def keyboard(draw: Draw) -> Design:
    """A compact keyboard."""
    columns, rows = draw.count(12, 14), draw.count(4, 5)
    x, y = columns * 0.0195 + 0.012, rows * 0.0195 + 0.014
    case = (
        slab([(-y / 2, 0), (y / 2, 0), (y / 2, 0.018), (-y / 2, 0.011)], x, rounding=0.003)
        .turn("x", 90)
        .turn("z", 90)
        .at(x=-x / 2)
    )
    grid = keys(columns, rows, 0.0195, 0.0195, 0.86, 0.007).turn("x", 4.0).at(z=0.013)
    colour, cap = draw.one(
        ("graphite", "black"),
        ("white", "ivory"),
        ("grey", "white"),
        ("mint", "white"),
        ("navy", "sky"),
        ("black", "graphite"),
    )
    return Design((Piece(case, "plastic", colour, 0.9), Piece(grid, "plastic", cap, 0.35)))


@family(small=(0.1, 0.2), large=(0.25, 0.3))
def loudspeaker(draw: Draw) -> Design:
    """A shelf loudspeaker with two cones."""
    x, y, z = draw.size(0.1, 0.12), draw.size(0.09, 0.12), draw.size(0.16, 0.19)
    cone = disc(x * 0.38, 0.006).turn("x", 90).at(y=-y / 2, z=z * 0.34)
    dust = lathe([(x * 0.28, 0.005), (x * 0.1, 0.009)], rounding=0.002).turn("x", 90).at(y=-y / 2, z=z * 0.34)
    tweeter = (
        lathe([(x * 0.2, 0), (x * 0.2, 0.004), (x * 0.1, 0.008)], rounding=0.002).turn("x", 90).at(y=-y / 2, z=z * 0.76)
    )
    made_of = draw.one("wood", "plastic")
    colour = (
        draw.one("walnut", "oak", "mahogany") if made_of == "wood" else draw.one("black", "white", "graphite", "red")
    )
    dark = "black" if colour != "black" else "grey"
    return Design(
        (
            Piece(box(x, y, z), made_of, colour, 0.5),
            Piece(cone + tweeter, "rubber", dark),
            Piece(dust, "plastic", draw.one("grey", "amber", "white")),
        )
    )


@family(small=(0.08, 0.15))
def alarm_clock(draw: Draw) -> Design:
    """An alarm clock with two bells."""
    radius, depth = draw.size(0.036, 0.045), draw.size(0.028, 0.036)
    drum = disc(radius, depth, rounding=0.005).turn("x", 90).at(y=depth / 2)
    face = disc(radius * 0.88, 0.002, rounding=0.0005).turn("x", 90).at(y=-depth / 2 + 0.001)
    hour = box(0.004, 0.002, radius * 0.5, rounding=0.001).turn("y", 50).at(y=-depth / 2 - 0.001)
    minute = box(0.003, 0.002, radius * 0.72, rounding=0.001).turn("y", -40).at(y=-depth / 2 - 0.001)
    bell = lathe([(radius * 0.4, 0), (radius * 0.34, 0.01), (radius * 0.1, 0.017)], rounding=0.01).at(z=radius + 0.001)
    leg = bar([(0, 0, -radius * 0.9), (0, 0, -radius - 0.014)], [0.012, 0.008])
    pairs = [solid.turn("y", sign * angle) for solid, angle in ((bell, 34), (leg, 32)) for sign in (-1, 1)]
    colour, metal = (
        draw.one("red", "teal", "black", "mint", "mustard", "white", "navy"),
        draw.one("steel", "brass", "copper"),
    )
    pieces = (
        Piece(drum, "plastic", colour, 0.8),
        Piece(face.seen_only(), "paper", "white" if colour != "white" else "sky"),
        Piece((hour + minute).seen_only(), "plastic", "black"),
        Piece(weld(pairs), "steel", metal, 0.4),
    )
    return Design(pieces)


@family(small=(0.08, 0.14))
def light_bulb(draw: Draw) -> Design:
    """A light bulb with its screw base."""
    radius = draw.size(0.028, 0.034)
    base = lathe([(0.008, 0), (0.013, 0.006), (0.0135, 0.028)], rounding=0.002)
    globe = lathe(
        [(0.0135, 0.028), (radius * 0.93, 0.06), (radius, 0.075), (radius * 0.8, 0.095), (radius * 0.3, 0.106)],
        rounding=0.03,
    )
    return Design(
        (
            Piece(globe, "glass", draw.one("white", "cream", "amber"), 0.12),
            Piece(base, "aluminium", draw.one("steel", "brass"), 0.4),
        ),
        TURNED,
    )
