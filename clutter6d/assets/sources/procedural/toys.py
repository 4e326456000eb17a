"""What lies on a child's floor."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.primitives import bar, box, disc, lathe, slab
from clutter6d.assets.sources.procedural.solid import Solid, weld
from clutter6d.assets.sources.procedural.symmetry import CUBE, HALF_TURN_Z, TURNED

BRIGHT = ("red", "blue", "green", "yellow", "orange", "teal", "violet", "sky", "pink", "lime")


def wheels(radius: float, width: float, xs: tuple[float, ...], track: float) -> Solid:
    """Pairs of wheels that stand on z = 0, at some places along x."""
    wheel = disc(radius, width, rounding=0.002).turn("x", 90)
    return weld([wheel.at(x, y + width / 2, radius) for x in xs for y in (-track / 2, track / 2)])


def toy_stuff(draw: Draw) -> tuple[str, float]:
    """Material and fill of a toy: painted wood or hollow plastic."""
    return draw.one(("wood", 1.0), ("plastic", 0.35))


@family(small=(0.09, 0.2), large=(0.25, 0.32))
def toy_car(draw: Draw) -> Design:
    """A car: saloon, van or pick-up."""
    length, width, high = 0.12, draw.size(0.048, 0.056), draw.size(0.022, 0.028)
    sill = [
        (-length / 2, 0.012),
        (length / 2, 0.012),
        (length / 2, high),
        (length * 0.42, high + 0.012),
        (-length / 2, high + 0.012),
    ]
    front, back = draw.one((0.2, -0.38), (0.26, -0.48), (0.2, -0.06))
    roof = high + draw.size(0.03, 0.036)
    cabin = [
        (length * back, high + 0.01),
        (length * front, high + 0.01),
        (length * (front - 0.12), roof),
        (length * (back + 0.05), roof),
    ]
    made_of, fill = toy_stuff(draw)
    colour, glass = draw.one(*BRIGHT), draw.one("sky", "white", "graphite", "cream")
    body = slab(sill, width, rounding=0.008).turn("x", 90).at(y=width / 2)
    top = slab(cabin, width * 0.86, rounding=0.006).turn("x", 90).at(y=width * 0.43)
    tyres = wheels(0.0145, 0.012, (-length * 0.3, length * 0.3), width)
    hubs = wheels(0.007, 0.0135, (-length * 0.3, length * 0.3), width).at(z=0.0075)
    return Design(
        (
            Piece(body, made_of, colour, fill),
            Piece(top, made_of, glass, fill),
            Piece(tyres, "rubber", "black"),
            Piece(hubs.seen_only(), "plastic", "yellow", 0.1),
        )
    )


@family(small=(0.08, 0.16))
def duck(draw: Draw) -> Design:
    """A bath duck."""
    plump = draw.size(0.9, 1.1)
    belly = lathe([(0.026, 0), (0.038, 0.012), (0.038, 0.026), (0.022, 0.042)], rounding=0.03).stretch(1.3, plump, 1)
    tail = bar(
        [(-0.036, 0, 0.024), (-0.052, 0, 0.034), (-0.06, 0, 0.046)], [0.036, 0.026, 0.008], [0.026, 0.018, 0.006]
    )
    head = lathe([(0.012, 0), (0.024, 0.01), (0.024, 0.026), (0.01, 0.04)], rounding=0.03).at(x=0.024, z=0.036)
    beak = bar([(0.042, 0, 0.052), (0.056, 0, 0.051), (0.064, 0, 0.053)], [0.02, 0.018, 0.013], [0.014, 0.009, 0.005])
    eye = disc(0.0035, 0.003, rounding=0.001).turn("x", 90)
    eyes = eye.at(0.033, -0.0195, 0.064) + eye.turn("x", 180).at(0.033, 0.0195, 0.064)
    made_of, fill = draw.one(("rubber", 0.25), ("plastic", 0.3), ("wood", 1.0))
    colour = draw.one("yellow", "yellow", "mustard", "pink", "sky", "white", "mint")
    return Design(
        (
            Piece(belly + tail + head, made_of, colour, fill),
            Piece(beak, made_of, "orange", fill),
            Piece(eyes.seen_only(), "plastic", "black", 0.2),
        )
    )


@family(small=(0.08, 0.2), large=(0.25, 0.32))
def toy_house(draw: Draw) -> Design:
    """A house with a gable roof, a chimney, a door and windows."""
    x, y, z = draw.size(0.07, 0.1), draw.size(0.06, 0.075), draw.size(0.045, 0.065)
    eave, rise = 0.006, draw.size(0.03, 0.045)
    gable = slab([(-y / 2 - eave, 0), (y / 2 + eave, 0), (0.002, rise), (-0.002, rise)], x + 2 * eave, rounding=0.002)
    roof = gable.turn("x", 90).turn("z", 90).at(x=-x / 2 - eave, z=z)
    chimney = box(0.013, 0.013, rise, rounding=0.001).at(x * 0.25, y * 0.2, z + rise * 0.35)
    door = box(0.016, 0.002, 0.028, rounding=0.0008).at(x=-x * 0.2, y=-y / 2)
    pane = box(0.016, 0.002, 0.014, rounding=0.0008)
    panes = weld(
        [pane.at(x * 0.22, -y / 2, z * 0.42), pane.at(x * 0.22, y / 2, z * 0.42), pane.at(-x * 0.2, y / 2, z * 0.42)]
    )
    made_of, fill = toy_stuff(draw)
    wall, tiles = (
        draw.one("cream", "white", "sky", "yellow", "mint", "sand", "rose"),
        draw.one("red", "brick", "navy", "forest", "brown"),
    )
    pieces = (
        Piece(box(x, y, z, rounding=0.002), made_of, wall, fill),
        Piece(roof, made_of, tiles, fill),
        Piece(chimney, made_of, "brick", fill),
        Piece(door.seen_only(), made_of, "walnut", 0.1),
        Piece(panes.seen_only(), made_of, "graphite", 0.1),
    )
    return Design(pieces)


@family(small=(0.1, 0.2), large=(0.25, 0.33))
def toy_train(draw: Draw) -> Design:
    """A steam engine."""
    length, width = draw.size(0.1, 0.12), 0.042
    frame = box(length, width, 0.012, rounding=0.003).at(z=0.012)
    boiler = disc(0.018, length * 0.58, rounding=0.003).turn("y", 90).at(x=-length * 0.1, z=0.04)
    cab = box(length * 0.3, width, 0.046, rounding=0.002).at(x=-length * 0.34, z=0.023)
    roof = box(length * 0.38, width * 1.12, 0.006, rounding=0.003).at(x=-length * 0.34, z=0.069)
    funnel = lathe([(0.0075, 0), (0.0075, 0.018), (0.0115, 0.026)], rounding=0.002).at(x=length * 0.36, z=0.054)
    dome = lathe([(0.009, 0), (0.009, 0.008), (0.003, 0.014)], rounding=0.006).at(x=length * 0.12, z=0.054)
    rolling = wheels(0.013, 0.009, (-length * 0.34, length * 0.02, length * 0.36), width)
    made_of, fill = toy_stuff(draw)
    one, two = draw.one("red", "blue", "green", "teal", "violet"), draw.one("yellow", "orange", "sky", "lime", "white")
    pieces = (
        Piece(boiler + cab, made_of, one, fill),
        Piece(frame + roof, made_of, two, fill),
        Piece(funnel + dome, made_of, draw.one("black", "brass"), fill),
        Piece(rolling, made_of, "graphite", fill),
    )
    return Design(pieces)


@family(small=(0.06, 0.11))
def toy_block(draw: Draw) -> Design:
    """A building cube."""
    edge = draw.size(0.05, 0.07)
    made_of, fill = toy_stuff(draw)
    colour = draw.one(*BRIGHT, "oak", "pine")
    cube = box(edge, edge, edge, rounding=0.004).at(z=-edge / 2)
    dot = disc(edge * 0.3, edge + 0.001, rounding=0.0003).at(z=-edge / 2 - 0.0005)
    dots = weld([dot, dot.turn("x", 90), dot.turn("y", 90)])
    return Design(
        (
            Piece(cube, made_of, colour, fill),
            Piece(dots.seen_only(), made_of, draw.one("white", "cream", "navy"), 0.01),
        ),
        CUBE,
    )


@family(small=(0.1, 0.2), large=(0.25, 0.3))
def ring_stack(draw: Draw) -> Design:
    """A cone of stacking rings."""
    count, radius = draw.count(3, 5), 0.048
    foot = lathe([(radius, 0), (radius * 0.92, 0.012)], rounding=0.004)
    step = 0.021
    pieces = [Piece(foot, "wood", draw.colour("wood"))]
    start = draw.count(0, 4)
    for i in range(count):
        rim = radius * (0.95 - 0.55 * i / count)
        layer = lathe([(rim * 0.86, 0), (rim, step * 0.3), (rim, step * 0.7), (rim * 0.86, step)], rounding=0.008)
        pieces.append(Piece(layer.at(z=0.0115 + (step - 0.0005) * i), "wood", BRIGHT[(start + i) % 5], 1.0))
    knob = lathe([(0.008, 0), (0.013, 0.009), (0.013, 0.016), (0.006, 0.026)], rounding=0.012)
    pieces.append(Piece(knob.at(z=0.0105 + (step - 0.0005) * count), "wood", "pine"))
    return Design(tuple(pieces), TURNED)


@family(small=(0.1, 0.2), large=(0.25, 0.33))
def toy_boat(draw: Draw) -> Design:
    """A boat with a deck house and a funnel."""
    length, width = draw.size(0.11, 0.14), draw.size(0.042, 0.052)
    plan = [
        (length / 2, 0),
        (length * 0.22, width / 2),
        (-length * 0.46, width / 2),
        (-length / 2, width * 0.4),
        (-length / 2, -width * 0.4),
        (-length * 0.46, -width / 2),
        (length * 0.22, -width / 2),
    ]
    hull = slab(plan, 0.024, rounding=0.012)
    waterline = slab(plan, 0.007, rounding=0.012).stretch(1.015, 1.015).at(z=0.019)
    house = box(length * 0.36, width * 0.6, 0.022, rounding=0.004).at(x=-length * 0.1, z=0.026)
    bridge = box(length * 0.18, width * 0.5, 0.016, rounding=0.003).at(x=-length * 0.04, z=0.048)
    funnel = disc(0.009, 0.03).at(x=-length * 0.2, z=0.046)
    one, two = draw.one("red", "blue", "teal", "navy", "green", "orange"), draw.one("white", "yellow", "cream")
    made_of, fill = toy_stuff(draw)
    pieces = (
        Piece(hull, made_of, one, fill),
        Piece(waterline + house, made_of, two, fill),
        Piece(bridge, made_of, draw.one(one, "sky"), fill),
        Piece(funnel, made_of, draw.one("red", "graphite", "yellow"), fill),
    )
    return Design(pieces)


@family(small=(0.1, 0.22))
def studded_block(draw: Draw) -> Design:
    """A large building brick with studs."""
    pitch, rows = 0.03, draw.count(3, 4)
    body = box(rows * pitch, 2 * pitch, draw.one(0.02, 0.036), rounding=0.002)
    height = float(body.shells[0].vertices[:, 2].max())
    stud = disc(0.0095, 0.009, rounding=0.001)
    studs = weld(
        [
            stud.at((i - (rows - 1) / 2) * pitch, (j - 0.5) * pitch, height - 0.001)
            for i in range(rows)
            for j in range(2)
        ]
    )
    return Design((Piece(body + studs, "plastic", draw.one(*BRIGHT, "white", "graphite"), 0.4),), HALF_TURN_Z)


@family(small=(0.08, 0.16))
def spinning_top(draw: Draw) -> Design:
    """A spinning top."""
    radius = draw.size(0.032, 0.042)
    body = lathe([(0.004, 0), (radius, 0.032), (radius * 0.96, 0.042), (0.012, 0.055)], rounding=0.006)
    band = disc(radius * 1.01, 0.008).at(z=0.033)
    stem = lathe([(0.006, 0.05), (0.0045, 0.085), (0.007, 0.095)], rounding=0.003)
    made_of = draw.one("wood", "plastic")
    one, two = draw.one(*BRIGHT), draw.one("white", "pine", "yellow", "navy")
    return Design((Piece(body, made_of, one, 0.8), Piece(band, made_of, two, 0.5), Piece(stem, made_of, two)), TURNED)
