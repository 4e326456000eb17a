"""Bottles, jars, cans and other closed vessels, full or empty."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import polygon_outline, rectangle_outline
from clutter6d.assets.sources.procedural.primitives import ROUND, bar, box, disc, lathe, slab
from clutter6d.assets.sources.procedural.symmetry import HALF_TURN_Z, SPOOL, TURNED, pyramid

FULL, PART_FULL, EMPTY = 1.0, 0.5, 0.08


def contents(draw: Draw) -> float:
    """How full a vessel is, as a mean density in kg/l."""
    return draw.one(FULL, PART_FULL, EMPTY)


@family(small=(0.15, 0.24), large=(0.25, 0.33))
def bottle(draw: Draw) -> Design:
    """A bottle of glass or plastic, with its cap."""
    radius, height, neck = draw.size(0.032, 0.042), draw.size(0.2, 0.27), draw.size(0.012, 0.015)
    shoulder = height * draw.size(0.5, 0.66)
    profile = [(radius, 0), (radius, shoulder), (neck * 1.1, shoulder + height * 0.2), (neck, height)]
    body = lathe(profile, rounding=draw.size(0.012, 0.03))
    cap = disc(neck * 1.15, 0.02).at(z=height - 0.002)
    label = disc(radius * 1.006, shoulder * 0.55, rounding=0.0005).at(z=shoulder * 0.2)
    made_of = draw.one("glass", "plastic")
    fill = contents(draw) * 1000 / (2500 if made_of == "glass" else 1000)
    body_piece = Piece(body, made_of, draw.colour(made_of), fill + (0.12 if made_of == "glass" else 0.0))
    paper = Piece(label.seen_only(), "paper", draw.one("white", "cream", "red", "navy", "mustard", "forest"), 0.01)
    return Design((body_piece, paper, Piece(cap, "plastic", draw.colour("plastic"), 0.6)), TURNED)


@family(small=(0.15, 0.24))
def square_bottle(draw: Draw) -> Design:
    """A bottle of square or six-sided section."""
    sides = draw.one(4, 6)
    radius, height = draw.size(0.038, 0.05), draw.size(0.13, 0.18)
    body = lathe(
        [(radius, 0), (radius, height * 0.7), (0.016, height * 0.86)],
        rounding=0.008,
        outline=polygon_outline(sides, 0.2),
    )
    neck = disc(0.013, height * 0.16).at(z=height * 0.85)
    cap = disc(0.017, height * 0.1).at(z=height * 0.99)
    fill = contents(draw) * 0.4 + 0.12
    pieces = (
        Piece(body + neck, "glass", draw.colour("glass"), fill),
        Piece(cap, "plastic", draw.one("black", "red", "white", "mustard")),
    )
    return Design(pieces, pyramid(sides))


@family(small=(0.08, 0.16))
def jar(draw: Draw) -> Design:
    """A preserving jar with a screw lid."""
    radius, height = draw.size(0.033, 0.045), draw.size(0.07, 0.13)
    body = lathe([(radius, 0), (radius, height * 0.8), (radius * 0.82, height * 0.92)], rounding=0.012)
    lid = disc(radius * 0.88, 0.018).at(z=height * 0.92 - 0.002)
    label = disc(radius * 1.008, height * 0.38, rounding=0.0005).at(z=height * 0.22)
    filling = draw.one("red", "amber", "plum", "green", "clear", "brown", "orange")
    lid_piece = Piece(lid, "steel", draw.one("brass", "red", "white", "black", "forest"), 0.06)
    return Design(
        (
            Piece(body, "glass", filling, contents(draw) * 0.4 + 0.13),
            Piece(label.seen_only(), "paper", draw.colour("paper"), 0.01),
            lid_piece,
        ),
        TURNED,
    )


@family(small=(0.08, 0.17))
def can(draw: Draw) -> Design:
    """A food or drinks can."""
    radius, height = draw.size(0.028, 0.043), draw.size(0.07, 0.125)
    rim = radius * draw.size(0.84, 0.97)
    bulge = height * 0.07
    body = lathe([(rim, 0), (radius, bulge), (radius, height - bulge), (rim, height)], rounding=0.004)
    ends = disc(rim * 0.97, height + 0.002, rounding=0.0005).at(z=-0.001)
    fill = draw.one(0.35, 0.35, 0.011)
    colour = draw.one("red", "blue", "green", "yellow", "steel", "orange", "teal", "violet", "white")
    return Design((Piece(body, "aluminium", colour, fill), Piece(ends.seen_only(), "aluminium", "steel", 0.01)), SPOOL)


@family(small=(0.1, 0.19))
def tube(draw: Draw) -> Design:
    """A tube of toothpaste or cream: round at the cap, flat at the crimp."""
    radius, length = draw.size(0.017, 0.024), draw.size(0.11, 0.16)
    body = bar(
        [(0, 0, 0), (length * 0.3, 0, 0), (length, 0, 0)],
        [radius * 2, radius * 2.1, radius * 2.9],
        [radius * 2, radius * 1.8, 0.003],
        rounding=0.03,
    )
    crimp = box(0.012, radius * 2.9, 0.003, rounding=0.001).at(x=length + 0.004, z=-0.0015)
    cap = lathe([(radius * 0.75, 0), (radius * 0.65, 0.022)], rounding=0.003).turn("y", -90)
    colour = draw.colour("plastic")
    cap_piece = Piece(cap, "plastic", draw.one("white", "graphite", colour), 0.5)
    return Design((Piece(body + crimp, "plastic", colour, draw.one(1.1, 0.6)), cap_piece))


@family(small=(0.15, 0.23))
def soap_dispenser(draw: Draw) -> Design:
    """A bottle with a pump."""
    radius, height = draw.size(0.032, 0.04), draw.size(0.11, 0.14)
    outline = draw.one(ROUND, rectangle_outline(1.8, 1.8, 0.3))
    body = lathe([(radius, 0), (radius, height * 0.85), (radius * 0.45, height)], rounding=0.014, outline=outline)
    collar, stem = disc(0.015, 0.018).at(z=height - 0.002), disc(0.005, 0.03).at(z=height + 0.014)
    nozzle = bar(
        [(-0.014, 0, 0), (0.02, 0, 0), (0.042, 0, -0.008)], [0.022, 0.017, 0.009], [0.01, 0.01, 0.008], rounding=0.01
    ).at(z=height + 0.046)
    made_of = draw.one("plastic", "ceramic", "glass")
    fill = {"plastic": 1.0, "ceramic": 0.6, "glass": 0.5}[made_of] * draw.one(1.0, 0.5)
    pump = draw.one("white", "black", "steel")
    return Design(
        (Piece(body, made_of, draw.colour(made_of), fill), Piece(collar + stem + nozzle, "plastic", pump, 0.6))
    )


@family(small=(0.18, 0.24), large=(0.25, 0.3))
def spray_bottle(draw: Draw) -> Design:
    """A cleaning spray with a trigger."""
    radius, height = draw.size(0.036, 0.044), draw.size(0.16, 0.19)
    body = lathe(
        [(radius, 0), (radius, height * 0.5), (radius * 0.72, height * 0.78), (0.016, height)], rounding=0.03
    ).stretch(y=0.75)
    collar = disc(0.017, 0.02).at(z=height - 0.002)
    head = bar(
        [(-0.025, 0, 0), (0.005, 0, 0.006), (0.055, 0, 0.006)], [0.022, 0.026, 0.014], [0.028, 0.03, 0.016], square=True
    ).at(z=height + 0.03)
    trigger = bar([(0.026, 0, height + 0.028), (0.036, 0, height), (0.03, 0, height - 0.025)], 0.012, 0.007)
    colour = draw.one("sky", "white", "lime", "mint", "pink", "clear")
    accent = draw.one("red", "blue", "orange", "green", "graphite")
    label = lathe([(radius * 1.004, height * 0.14), (radius * 1.004, height * 0.42)], rounding=0.0005).stretch(y=0.755)
    bottle_piece = Piece(body, "plastic", colour, draw.one(1.0, 0.5, 0.1))
    return Design(
        (
            bottle_piece,
            Piece(label.seen_only(), "paper", draw.one("white", "yellow", accent), 0.01),
            Piece(collar + head + trigger, "plastic", accent, 0.5),
        )
    )


@family(small=(0.12, 0.24))
def drinks_carton(draw: Draw) -> Design:
    """A milk or juice carton with a gable top."""
    x, y, height = draw.size(0.06, 0.072), draw.size(0.06, 0.072), draw.size(0.11, 0.19)
    body = box(x, y, height, rounding=0.002)
    gable = slab([(-y / 2, 0), (y / 2, 0), (0.003, y * 0.42), (-0.003, y * 0.42)], x, rounding=0.001)
    roof = gable.turn("x", 90).turn("z", 90).at(x=-x / 2, z=height)
    crest = box(x, 0.004, 0.016, rounding=0.001).at(z=height + y * 0.4)
    band = box(x + 0.0008, y + 0.0008, height * draw.size(0.25, 0.5), rounding=0.002).at(z=height * 0.15)
    white, accent = draw.one("white", "cream"), draw.one("blue", "green", "orange", "red", "sky", "violet")
    fill = draw.one(1.4, 0.75, 0.07)
    pieces = (Piece(body + roof + crest, "cardboard", white, fill), Piece(band.seen_only(), "cardboard", accent, 0.01))
    return Design(pieces, HALF_TURN_Z)


@family(small=(0.08, 0.15))
def pill_bottle(draw: Draw) -> Design:
    """A medicine bottle with a broad cap."""
    radius, height = draw.size(0.02, 0.028), draw.size(0.055, 0.08)
    body = lathe([(radius, 0), (radius, height * 0.86), (radius * 0.8, height)], rounding=0.006)
    cap = disc(radius * 1.02, 0.022).at(z=height - 0.002)
    label = disc(radius * 1.01, height * 0.5, rounding=0.0005).at(z=height * 0.18)
    pieces = (
        Piece(body, "plastic", draw.one("orange", "amber", "white", "brown"), draw.one(0.5, 0.15)),
        Piece(label.seen_only(), "paper", "white", 0.01),
        Piece(cap, "plastic", draw.one("white", "red", "blue"), 0.4),
    )
    return Design(pieces, TURNED)
