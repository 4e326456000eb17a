"""What is used about the house."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import polygon_outline
from clutter6d.assets.sources.procedural.primitives import arch, bar, box, disc, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import BOX, SPOOL, Symmetry, prism


@family(small=(0.14, 0.22), large=(0.25, 0.32))
def shoe(draw: Draw) -> Design:
    """A low shoe with its sole."""
    width, thick = draw.size(0.09, 0.1), draw.size(0.018, 0.026)
    fore = [
        (0.13, -0.018),
        (0.135, 0.008),
        (0.12, 0.034),
        (0.06, width / 2),
        (-0.01, width * 0.4),
        (-0.01, -width * 0.4),
        (0.06, -width / 2),
        (0.11, -0.036),
    ]
    rear = [
        (0.0, width * 0.41),
        (-0.09, width * 0.36),
        (-0.13, width * 0.22),
        (-0.138, 0.0),
        (-0.13, -width * 0.22),
        (-0.09, -width * 0.36),
        (0.0, -width * 0.41),
    ]
    sole = slab(fore, thick, rounding=0.02) + slab(rear, thick, rounding=0.02)
    path = [(0.118, 0, thick + 0.016), (0.09, 0, thick + 0.022), (0.035, 0, thick + 0.032), (-0.015, 0, thick + 0.042)]
    toe = bar(path, [0.055, width * 0.84, width * 0.86, width * 0.74], [0.026, 0.044, 0.064, 0.084], rounding=0.02)
    heel_path = [
        (-0.012, 0, thick + 0.042),
        (-0.07, 0, thick + 0.034),
        (-0.118, 0, thick + 0.04),
        (-0.13, 0, thick + 0.04),
    ]
    heel = bar(
        heel_path, [width * 0.74, width * 0.72, width * 0.62, width * 0.45], [0.084, 0.07, 0.082, 0.07], rounding=0.02
    )
    opening = bar(
        [(-0.035, 0, thick + 0.074), (-0.07, 0, thick + 0.066), (-0.1, 0, thick + 0.072)], [0.03, 0.042, 0.036], 0.014
    )
    lace = box(0.006, width * 0.5, 0.004, rounding=0.002)
    laces = weld(
        [
            lace.turn("y", 20).at(x=x, z=z + thick)
            for x, z in ((0.062, 0.048), (0.042, 0.057), (0.022, 0.0665), (0.003, 0.0765))
        ]
    )
    made_of = draw.one("leather", "fabric")
    upper = Piece(toe + heel, made_of, draw.colour(made_of), 0.35 if made_of == "leather" else 0.8)
    trim = Piece(opening.seen_only(), "fabric", draw.one("black", "cream", "graphite"), 0.3)
    return Design(
        (
            upper,
            Piece(sole, "rubber", draw.one("white", "black", "sand"), 0.5),
            trim,
            Piece(laces.seen_only(), "fabric", draw.one("white", "black"), 0.5),
        )
    )


@family(small=(0.12, 0.24), large=(0.25, 0.3))
def dumbbell(draw: Draw) -> Design:
    """A dumb-bell, with hexagonal or round heads."""
    radius, width, grip = draw.size(0.032, 0.042), draw.size(0.04, 0.055), draw.size(0.1, 0.12)
    outline = polygon_outline(6, 0.1)
    profile = [(radius * 0.86, 0), (radius, width * 0.15), (radius, width * 0.85), (radius * 0.86, width)]
    has_corners = draw.chance(0.6)
    head = lathe(profile, rounding=0.004, outline=outline) if has_corners else lathe(profile, rounding=0.004)
    heads = head.at(z=grip / 2) + head.at(z=-grip / 2 - width)
    shaft = disc(0.0135, grip + 0.004).at(z=-grip / 2 - 0.002)
    colour, made_of = draw.one("graphite", "pink", "teal", "violet", "red", "blue"), draw.one("iron", "rubber")
    pieces = (
        Piece(heads.turn("y", 90), made_of, colour, 0.35 if made_of == "iron" else 1.6),
        Piece(shaft.turn("y", 90), "steel", "steel", 0.5),
    )
    return Design(pieces, Symmetry((("x", 6), ("z", 2))) if has_corners else Symmetry((("z", 2),), continuous="x"))


@family(small=(0.09, 0.13))
def sponge(draw: Draw) -> Design:
    """A kitchen sponge with its rough side."""
    x, y, z = draw.size(0.1, 0.12), draw.size(0.06, 0.075), draw.size(0.024, 0.032)
    body, scourer = box(x, y, z, rounding=0.006), box(x, y, 0.008, rounding=0.003).at(z=z - 0.001)
    pieces = (
        Piece(body, "sponge", draw.colour("sponge")),
        Piece(scourer, "fabric", draw.one("forest", "navy", "plum", "graphite"), 0.5),
    )
    return Design(pieces, Symmetry((("z", 2),)))


@family(small=(0.14, 0.24), large=(0.25, 0.32))
def scrubbing_brush(draw: Draw) -> Design:
    """A hand brush with a handle."""
    block = box(draw.size(0.09, 0.12), 0.05, 0.016, rounding=0.012).at(z=0.03)
    reach = float(block.shells[0].vertices[:, 0].max())
    bristles = slab(
        [(-reach * 0.92, -0.018), (reach * 0.92, -0.018), (reach * 0.92, 0.018), (-reach * 0.92, 0.018)],
        0.032,
        rounding=0.006,
    )
    handle = bar(
        [(-reach + 0.006, 0, 0.038), (-reach - 0.04, 0, 0.046), (-reach - 0.12, 0, 0.048)],
        [0.036, 0.02, 0.024],
        [0.014, 0.013, 0.016],
    )
    made_of = draw.one("wood", "plastic")
    return Design(
        (
            Piece(block + handle, made_of, draw.colour(made_of)),
            Piece(bristles, "fabric", draw.one("sand", "white", "graphite", "sky"), 0.7),
        )
    )


@family(small=(0.1, 0.16), large=(0.25, 0.29))
def paper_roll(draw: Draw) -> Design:
    """A roll of kitchen or toilet paper."""
    radius, height = draw.size(0.045, 0.058), draw.one(0.1, draw.size(0.1, 0.24))
    body = ring(radius, 0.021, height, sectors=8)
    core = ring(0.0212, 0.019, height, sectors=8)
    pieces = (
        Piece(body, "paper", draw.one("white", "white", "cream", "sky"), 0.09),
        Piece(core.seen_only(), "cardboard", "kraft", 0.6),
    )
    return Design(pieces, SPOOL)


@family(small=(0.07, 0.1))
def soap(draw: Draw) -> Design:
    """A bar of soap, rectangular, oval or six-sided."""
    x, y, z = draw.size(0.075, 0.09), draw.size(0.05, 0.06), draw.size(0.022, 0.032)
    kind = draw.one("bar", "oval", "hexagon")
    if kind == "bar":
        body, symmetry = box(x, y, z, rounding=0.012), BOX
    elif kind == "oval":
        body = lathe([(0.8, 0), (1.0, 0.3), (1.0, 0.7), (0.8, 1.0)], rounding=0.3).stretch(x / 2, y / 2, z)
        symmetry = BOX
    else:
        body, symmetry = disc(x / 2, z, rounding=0.006, outline=polygon_outline(6)), prism(6)
    return Design((Piece(body, "wax", draw.colour("wax"), 1.1),), symmetry)


@family(small=(0.09, 0.15))
def padlock(draw: Draw) -> Design:
    """A padlock with its shackle."""
    x, z, y = draw.size(0.045, 0.055), draw.size(0.038, 0.05), draw.size(0.018, 0.024)
    body = box(x, y, z, rounding=0.005)
    high = z + draw.size(0.026, 0.04)
    inset = x * 0.32
    bow = bar(arch(inset, z - 0.004, high), 0.0075, rounding=0.02)
    plate = box(x * 0.6, y + 0.0012, z * 0.5, rounding=0.002).at(z=z * 0.2)
    made_of = draw.one("brass", "steel")
    pieces = (
        Piece(
            body,
            made_of,
            draw.one("brass", "copper") if made_of == "brass" else draw.one("iron", "red", "blue", "steel"),
            0.7,
        ),
        Piece(plate.seen_only(), "steel", "graphite", 0.05),
        Piece(bow, "steel", "steel"),
    )
    return Design(pieces, Symmetry((("z", 2),)))


@family(large=(0.25, 0.3))
def clothes_iron(draw: Draw) -> Design:
    """A clothes iron."""
    width = draw.size(0.1, 0.115)
    plan = [
        (0.13, 0),
        (0.07, width * 0.38),
        (-0.05, width / 2),
        (-0.11, width * 0.42),
        (-0.11, -width * 0.42),
        (-0.05, -width / 2),
        (0.07, -width * 0.38),
    ]
    plate = slab(plan, 0.01, rounding=0.02)
    body = slab(plan, 0.036, rounding=0.02).stretch(0.93, 0.9).at(z=0.009)
    dome = slab(plan, 0.03, rounding=0.02).stretch(0.72, 0.62).at(x=-0.005, z=0.044)
    handle = bar(
        [(-0.078, 0, 0.045), (-0.088, 0, 0.115), (0.0, 0, 0.118), (0.075, 0, 0.075), (0.07, 0, 0.05)], 0.03, 0.022
    )
    dial = disc(0.016, 0.01).at(x=-0.005, z=0.073)
    colour, second = (
        draw.one("white", "sky", "violet", "teal", "red", "graphite"),
        draw.one("graphite", "navy", "white"),
    )
    pieces = (
        Piece(body + dome, "plastic", colour, 0.55),
        Piece(plate, "steel", "steel", 0.35),
        Piece(handle, "plastic", second, 0.6),
        Piece(dial, "plastic", draw.one("amber", "red", "grey")),
    )
    return Design(pieces)
