"""Boxes with and without lids, trays and what comes packed."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import rectangle_outline
from clutter6d.assets.sources.procedural.primitives import arch, bar, box, cup, open_box, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import BOX, HALF_TURN_Z


@family(small=(0.08, 0.24), large=(0.25, 0.35))
def closed_box(draw: Draw) -> Design:
    """A packed cardboard box, from tea to cereal."""
    x, y, z = draw.size(0.1, 0.2), draw.size(0.05, 0.12), draw.size(0.04, 0.14)
    colour = draw.colour("cardboard")
    body = box(x, y, z, rounding=0.002)
    band = box(x * draw.size(0.25, 0.5), y + 0.0008, z + 0.0008, rounding=0.002).at(z=-0.0004)
    stripe = Piece(band.seen_only(), "cardboard", draw.one("white", "cream", "navy", "red", "forest", "mustard"), 0.01)
    return Design((Piece(body, "cardboard", colour, draw.size(0.12, 0.9)), stripe), BOX)


@family(small=(0.1, 0.24), large=(0.25, 0.34))
def open_crate(draw: Draw) -> Design:
    """An open box of wood, cardboard or plastic."""
    x, y, z = draw.size(0.16, 0.24), draw.size(0.1, 0.16), draw.size(0.05, 0.1)
    made_of = draw.one("cardboard", "wood", "plastic")
    wall = {"cardboard": 0.004, "wood": 0.009, "plastic": 0.005}[made_of]
    return Design((Piece(open_box(x, y, z, wall), made_of, draw.colour(made_of)),), HALF_TURN_Z)


@family(small=(0.1, 0.22), large=(0.25, 0.32))
def lidded_box(draw: Draw) -> Design:
    """A gift or shoe box with an overlapping lid."""
    x, y, z = draw.size(0.14, 0.22), draw.size(0.1, 0.14), draw.size(0.06, 0.11)
    colour, lid_height = draw.colour("cardboard"), draw.size(0.022, 0.035)
    lid = box(x + 0.006, y + 0.006, lid_height, rounding=0.003).at(z=z - lid_height + 0.002)
    lid_colour = draw.one(colour, "white", "navy", "rose", "forest", "graphite")
    return Design(
        (Piece(box(x, y, z), "cardboard", colour, draw.size(0.1, 0.6)), Piece(lid, "cardboard", lid_colour, 0.3)),
        HALF_TURN_Z,
    )


@family(large=(0.25, 0.35))
def tray(draw: Draw) -> Design:
    """A serving tray with a slanting rim and grips."""
    rim = draw.size(0.1, 0.112)
    outline = rectangle_outline(rounding=0.3)
    body = cup([(0.09, 0), (rim, draw.size(0.018, 0.03))], wall=0.005, floor=0.005, outline=outline)
    made_of = draw.one("wood", "plastic", "steel")
    return Design((Piece(body.stretch(draw.size(1.3, 1.55)), made_of, draw.colour(made_of)),), HALF_TURN_Z)


@family(small=(0.12, 0.24), large=(0.25, 0.28))
def tissue_box(draw: Draw) -> Design:
    """A tissue box with a tissue standing out of it."""
    x, y, z = draw.one((0.22, 0.115, draw.size(0.06, 0.08)), (0.115, 0.115, draw.size(0.11, 0.13)))
    opening = box(min(x * 0.5, 0.1), 0.03, 0.0012, rounding=0.014).at(z=z - 0.0002)
    petal = slab([(-0.028, 0), (0.028, 0), (0.04, 0.03), (0.006, 0.048), (-0.038, 0.034)], 0.005, rounding=0.012)
    tissue = petal.turn("x", 78).at(y=0.006, z=z) + petal.turn("x", 104).turn("z", 16).at(y=-0.001, z=z)
    box_piece = Piece(
        box(x, y, z), "cardboard", draw.one("sky", "mint", "rose", "sand", "teal", "violet", "sage"), 0.22
    )
    return Design(
        (box_piece, Piece(opening.seen_only(), "cardboard", "graphite", 0.01), Piece(tissue, "paper", "white", 0.15))
    )


@family(small=(0.14, 0.24), large=(0.25, 0.3))
def basket(draw: Draw) -> Design:
    """A round or square basket with a bow handle."""
    rim, height = draw.size(0.08, 0.095), draw.size(0.06, 0.085)
    outline = draw.one(None, rectangle_outline(1.8, 1.8, 0.3))
    body = cup([(rim * 0.8, 0), (rim, height)], wall=0.006, floor=0.006, outline=outline, sectors=8)
    reach = rim * (0.96 if outline is None else 0.87)
    bow = bar(arch(reach, height - 0.02, height * 1.85), 0.018, 0.006, rounding=0.1)
    made_of = draw.one("wood", "plastic")
    colour = draw.colour(made_of)
    return Design((Piece(body, made_of, colour, 0.7), Piece(bow, made_of, colour)), HALF_TURN_Z)


@family(small=(0.1, 0.2))
def egg_carton(draw: Draw) -> Design:
    """A closed carton for six eggs."""
    x, y = draw.size(0.14, 0.16), draw.size(0.095, 0.11)
    rim = box(x, y, 0.006, rounding=0.01).at(z=0.033)
    feet = weld(
        [
            box(x / 3.4, y / 2.3, 0.034, rounding=0.012).at(dx * x / 3.1, dy * y / 4.1)
            for dx in (-1, 0, 1)
            for dy in (-1, 1)
        ]
    )
    lid = box(x * 0.96, y * 0.94, 0.032, rounding=0.012).at(z=0.038)
    colour = draw.one("grey", "sage", "sand", "sky", "kraft")
    return Design((Piece(feet + rim + lid, "cardboard", colour, draw.one(0.8, 0.12)),), HALF_TURN_Z)
