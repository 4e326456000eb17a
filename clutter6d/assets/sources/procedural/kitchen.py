"""What is cooked with."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import circle
from clutter6d.assets.sources.procedural.primitives import arch, bar, box, cup, disc, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import HALF_TURN_Z, TURNED, Symmetry
from clutter6d.assets.sources.procedural.tableware import ear


@family(large=(0.26, 0.35))
def pan(draw: Draw) -> Design:
    """A frying pan with a long handle."""
    radius, height = draw.size(0.08, 0.095), draw.size(0.03, 0.045)
    made_of = draw.one("iron", "aluminium", "steel")
    body = cup([(radius * 0.82, 0), (radius, height)], wall=0.005, floor=0.005, sectors=10)
    path = [
        (radius * 0.95, 0, height * 0.72),
        (radius + 0.05, 0, height + 0.012),
        (radius + draw.size(0.13, 0.15), 0, height + 0.018),
    ]
    grip = bar(path, [0.014, 0.02, 0.026], [0.008, 0.012, 0.015], rounding=0.02)
    handle = (
        Piece(grip, "iron", draw.colour("iron"))
        if made_of == "iron"
        else Piece(grip, "wood", draw.one("black", "walnut", "oak"))
    )
    return Design((Piece(body, made_of, draw.colour(made_of)), handle))


@family(small=(0.16, 0.24), large=(0.25, 0.33))
def pot(draw: Draw) -> Design:
    """A cooking pot with two handles, with or without its lid."""
    radius, height = draw.size(0.075, 0.09), draw.size(0.085, 0.12)
    made_of = draw.one("steel", "aluminium", "ceramic")
    wall = 0.005 if made_of == "ceramic" else 0.003
    loop = [
        (radius - 0.004, -0.028, 0),
        (radius + 0.022, -0.024, 0),
        (radius + 0.022, 0.024, 0),
        (radius - 0.004, 0.028, 0),
    ]
    handle = bar(loop, 0.009, 0.011, side=(0, 0, 1), rounding=0.012).at(z=height * 0.82)
    colour = draw.colour(made_of)
    handles = Piece(handle + handle.turn("z", 180), made_of, "graphite")
    if draw.chance(0.5):
        body = cup([(radius, 0), (radius, height)], wall=wall, floor=0.005, sectors=8, rounding=0.006)
        return Design((Piece(body, made_of, colour), handles), HALF_TURN_Z)
    closed = disc(radius, height, rounding=0.006)
    lid = lathe([(radius * 1.02, height), (radius * 0.95, height + 0.006), (0.02, height + 0.016)], rounding=0.008)
    knob = lathe([(0.008, 0), (0.015, 0.012), (0.013, 0.018)]).at(z=height + 0.015)
    pieces = (
        Piece(closed, made_of, colour, 0.12),
        handles,
        Piece(lid, made_of, colour, 0.4),
        Piece(knob, "plastic", "black"),
    )
    return Design(pieces, HALF_TURN_Z)


@family(large=(0.26, 0.35))
def spatula(draw: Draw) -> Design:
    """A turner with slots, its blade bent up."""
    width, length = draw.size(0.07, 0.085), draw.size(0.08, 0.1)
    bars = draw.count(3, 4)
    rails = weld(
        [
            box(length * 0.7, width * 0.14, 0.0035, rounding=0.001).at(
                length * 0.1, (i / (bars - 1) - 0.5) * width * 0.86
            )
            for i in range(bars)
        ]
    )
    front = box(length * 0.2, width, 0.0035, rounding=0.002).at(x=length * 0.5)
    back = slab(
        [(-length * 0.2, -width / 2), (-length * 0.2, width / 2), (-length * 0.38, 0.012), (-length * 0.38, -0.012)],
        0.0035,
    ).stretch(-1)
    blade = weld([rails, front, back.stretch(-1)])
    arm = bar(
        [(-length * 0.36, 0, 0.002), (-length * 0.75, 0, 0.03), (-length * 1.5, 0, 0.045)],
        0.012,
        0.006,
        square=True,
        rounding=0.02,
    )
    grip = bar([(-length * 1.45, 0, 0.044), (-length * 2.4, 0, 0.058)], [0.018, 0.024], 0.016)
    made_of = draw.one("plastic", "steel", "wood")
    colour = draw.colour(made_of)
    return Design(
        (Piece(blade + arm, made_of, colour), Piece(grip, "plastic", draw.one("black", "red", "teal", "graphite")))
    )


@family(large=(0.25, 0.34))
def cleaver(draw: Draw) -> Design:
    """A kitchen cleaver with a broad blade."""
    length, width = draw.size(0.16, 0.19), draw.size(0.07, 0.09)
    blade = slab(
        [(0, -width * 0.7), (length, -width * 0.72), (length * 1.01, width * 0.26), (0, width * 0.3)],
        0.003,
        rounding=0.008,
    )
    grip = bar([(-0.12, 0, 0), (-0.06, 0, 0), (0.012, 0, 0)], [0.028, 0.024, 0.024], 0.018, rounding=0.02)
    colour = draw.one("walnut", "mahogany", "black", "oak")
    return Design((Piece(blade, "steel", "steel"), Piece(grip.at(z=0.0015, y=width * 0.12), "wood", colour)))


@family(large=(0.26, 0.35))
def chopping_board(draw: Draw) -> Design:
    """A board with a short handle."""
    length, width, thickness = draw.size(0.2, 0.24), draw.size(0.13, 0.17), draw.size(0.014, 0.02)
    board = box(length, width, thickness, rounding=0.02)
    neck = slab([(0, -0.03), (0.05, -0.018), (0.07, 0), (0.05, 0.018), (0, 0.03)], thickness, rounding=0.012).at(
        x=length / 2 - 0.004
    )
    made_of = draw.one("wood", "wood", "plastic")
    colour = draw.colour(made_of)
    return Design((Piece(board + neck, made_of, colour),), Symmetry((("x", 2),)))


@family(large=(0.27, 0.35))
def rolling_pin(draw: Draw) -> Design:
    """A rolling pin with turned handles."""
    length, radius = draw.size(0.18, 0.22), draw.size(0.022, 0.03)
    barrel = disc(radius, length, rounding=0.006)
    knob = lathe([(0.009, 0), (0.014, 0.02), (0.015, 0.045), (0.008, 0.06)], rounding=0.012)
    handles = knob.at(z=length - 0.002) + knob.turn("x", 180).at(z=0.002)
    colour = draw.colour("wood")
    pieces = (
        Piece(barrel.turn("y", 90), "wood", colour),
        Piece(handles.turn("y", 90), "wood", draw.one(colour, "red", "black")),
    )
    return Design(pieces, Symmetry((("z", 2),), continuous="x"))


@family(small=(0.08, 0.13))
def shaker(draw: Draw) -> Design:
    """A salt or pepper shaker."""
    radius, height = draw.size(0.02, 0.027), draw.size(0.06, 0.085)
    body = lathe([(radius, 0), (radius * 0.72, height * 0.6), (radius * 0.8, height)], rounding=0.02, edge=0.003)
    cap = lathe([(radius * 0.85, 0), (radius * 0.85, 0.012), (radius * 0.4, 0.02)], rounding=0.006).at(z=height - 0.002)
    made_of = draw.one("glass", "ceramic", "wood")
    return Design((Piece(body, made_of, draw.colour(made_of), 0.6), Piece(cap, "steel", "steel", 0.15)), TURNED)


@family(small=(0.15, 0.24), large=(0.25, 0.32))
def pitcher(draw: Draw) -> Design:
    """A jug with a handle and a lip."""
    radius, height = draw.size(0.05, 0.06), draw.size(0.15, 0.2)
    made_of = draw.one("ceramic", "glass", "plastic", "steel")
    body = cup(
        [(radius * 0.85, 0), (radius, height * 0.3), (radius * draw.size(0.8, 0.95), height)],
        wall=0.005,
        floor=0.008,
        sectors=8,
    )
    handle = ear(radius * 0.92, height * 0.25, height * 0.88, 0.035, 0.012)
    top = -radius * 0.86
    lip = bar([(top + 0.002, 0, height - 0.02), (top - 0.02, 0, height - 0.002)], [0.03, 0.018], [0.012, 0.006])
    colour = draw.colour(made_of)
    return Design((Piece(body + handle, made_of, colour), Piece(lip, made_of, colour)))


@family(small=(0.09, 0.14))
def pastry_cutter(draw: Draw) -> Design:
    """A round pastry cutter with a grip."""
    radius = draw.size(0.035, 0.05)
    rim = ring(radius, radius - 0.004, draw.size(0.03, 0.04), sectors=8)
    grip = bar(arch(radius - 0.002, 0.026, 0.07), 0.012, 0.006, rounding=0.02)
    return Design((Piece(rim, "steel", "steel"), Piece(grip, "plastic", draw.colour("plastic"))), HALF_TURN_Z)


@family(small=(0.07, 0.11))
def cheese_wedge(draw: Draw) -> Design:
    """A piece of cheese, a wedge cut from a wheel."""
    angle = draw.size(0.5, 0.9)
    radius, height = draw.size(0.08, 0.1), draw.size(0.03, 0.05)
    arc = circle(64, radius, 0.0)[: int(64 * angle / 6.283) + 1]
    corners = [(0.0, 0.0), *((float(x), float(y)) for x, y in arc[:: max(1, len(arc) // 4)])]
    return Design((Piece(slab(corners, height, rounding=0.003), "food", draw.one("yellow", "mustard", "cream")),))
