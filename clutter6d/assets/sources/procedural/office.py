"""What lies on a desk."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import polygon_outline
from clutter6d.assets.sources.procedural.primitives import bar, box, cup, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import HALF_TURN_X, HALF_TURN_Y, SPOOL, TURNED, TURNED_X, pyramid


@family(small=(0.13, 0.24), large=(0.25, 0.33))
def book(draw: Draw) -> Design:
    """A bound book: covers, spine and pages."""
    length, width, thickness = draw.size(0.19, 0.25), draw.size(0.125, 0.175), draw.size(0.014, 0.045)
    cover = 0.003
    pages = box(length - 0.006, width - 0.004, thickness, rounding=0.001).at(z=cover, y=-0.001)
    board = box(length, width, cover, rounding=0.001)
    spine = box(length, 0.004, thickness + 2 * cover, rounding=0.003).at(y=width / 2)
    block = box(length, width, thickness + 2 * cover).at(y=0.001)
    binding = weld([board, board.at(z=thickness + cover), spine])
    colour = draw.one("red", "navy", "forest", "mustard", "plum", "teal", "graphite", "terracotta", "sky", "sage")
    return Design(
        (Piece(pages.seen_only(), "paper", "ivory", 0.85), Piece(binding.felt_as(block), "cardboard", colour)),
        HALF_TURN_Y,
    )


@family(small=(0.12, 0.19))
def stapler(draw: Draw) -> Design:
    """A desk stapler, slightly open."""
    length, width = draw.size(0.12, 0.15), draw.size(0.028, 0.036)
    base = box(length, width, 0.009, rounding=0.004)
    arm = bar(
        [(-length / 2, 0, 0.026), (0, 0, 0.035), (length * 0.48, 0, 0.036)],
        [width, width * 0.96, width * 0.7],
        [0.026, 0.026, 0.014],
        square=True,
    )
    magazine = box(length * 0.92, width * 0.55, 0.008, rounding=0.001).turn("y", -3).at(x=length * 0.01, z=0.015)
    hinge = box(0.03, width * 1.04, 0.024, rounding=0.006).at(x=-length / 2 + 0.018, z=0.006)
    colour = draw.one("red", "black", "blue", "graphite", "teal", "white")
    return Design(
        (Piece(arm + hinge, "plastic", colour), Piece(base, "plastic", "black"), Piece(magazine, "steel", "steel", 0.7))
    )


@family(small=(0.1, 0.16))
def tape_dispenser(draw: Draw) -> Design:
    """A heavy tape dispenser with a roll in it."""
    width, radius = draw.size(0.04, 0.052), draw.size(0.027, 0.032)
    side = [(-0.06, 0), (0.065, 0), (0.07, 0.034), (0.03, 0.02), (-0.02, 0.02), (-0.06, 0.03)]
    body = slab([side[0], side[1], (0.065, 0.018), (-0.062, 0.018)], width, rounding=0.006)
    front = slab([(0.035, 0.012), (0.066, 0.012), (0.07, 0.036), (0.062, 0.036)], width, rounding=0.003)
    cheek = slab(
        [(-0.056, 0.01), (0.012, 0.01), (-0.004, 0.036), (-0.022, 0.05), (-0.042, 0.036)], 0.006, rounding=0.01
    )
    roll = ring(radius, radius * 0.62, width * 0.6).at(-0.022, radius + 0.021, width * 0.2)
    shell = weld([body, front, cheek, cheek.at(z=width - 0.006)])
    stand, tape = shell.turn("x", 90), roll.turn("x", 90)
    colour = draw.one("graphite", "black", "red", "sky", "mint", "pink")
    return Design(
        (
            Piece(stand, "plastic", colour, draw.one(1.0, 1.8)),
            Piece(tape, "plastic", draw.one("amber", "clear", "sand")),
        )
    )


@family(small=(0.08, 0.13))
def pencil_cup(draw: Draw) -> Design:
    """A cup for pencils, round or polygonal."""
    radius, height = draw.size(0.036, 0.046), draw.size(0.085, 0.11)
    sides = draw.one(0, 4, 6, 8)
    outline = polygon_outline(sides) if sides else None
    made_of = draw.one("wood", "plastic", "steel", "leather", "ceramic")
    body = cup(
        [(radius * draw.size(0.85, 1), 0), (radius, height)], wall=0.004, floor=0.005, outline=outline, sectors=8
    )
    return Design((Piece(body, made_of, draw.colour(made_of)),), pyramid(sides) if sides else TURNED)


@family(small=(0.07, 0.12))
def tape_roll(draw: Draw) -> Design:
    """A roll of adhesive tape."""
    radius, height = draw.size(0.04, 0.055), draw.size(0.02, 0.048)
    tape = ring(radius, radius * 0.7, height).felt_as(ring(radius, radius * 0.66, height))
    core = ring(radius * 0.71, radius * 0.66, height * 0.99)
    core = core.at(z=height * 0.005)
    colour = draw.one("sand", "graphite", "clear", "red", "blue", "mustard", "green")
    tape_only = Piece(tape, "plastic", colour)
    return Design((tape_only, Piece(core.seen_only(), "cardboard", "kraft")), SPOOL)


@family(small=(0.13, 0.2))
def marker(draw: Draw) -> Design:
    """A thick felt pen."""
    radius, length = draw.size(0.008, 0.011), draw.size(0.12, 0.14)
    colour = draw.one("red", "blue", "green", "black", "orange", "violet", "teal")
    barrel = lathe([(radius * 0.8, 0), (radius, 0.006), (radius, length * 0.66)], rounding=0.003)
    cap = lathe(
        [(radius * 1.08, length * 0.66), (radius * 1.08, length * 0.97), (radius * 0.8, length)], rounding=0.003
    )
    white = draw.one("white", "grey", colour)
    return Design(
        (Piece(barrel.turn("y", 90), "plastic", white, 0.6), Piece(cap.turn("y", 90), "plastic", colour, 0.5)), TURNED_X
    )


@family(large=(0.26, 0.34))
def ring_binder(draw: Draw) -> Design:
    """A ring binder, narrow at its open edge."""
    length, width, spine = draw.size(0.28, 0.32), draw.size(0.24, 0.28), draw.size(0.04, 0.075)
    wedge = slab(
        [(-width / 2, -spine / 2), (width / 2, -spine / 3), (width / 2, spine / 3), (-width / 2, spine / 2)],
        length,
        rounding=0.003,
    )
    label = box(0.0012, spine * 0.5, length * 0.4, rounding=0.001).at(x=-width / 2 - 0.0004, z=length * 0.3)
    colour = draw.one("graphite", "red", "blue", "forest", "mustard", "grey")
    return Design(
        (Piece(wedge, "cardboard", colour, draw.size(0.2, 0.45)), Piece(label.seen_only(), "paper", "white", 0.1)),
        HALF_TURN_X,
    )
