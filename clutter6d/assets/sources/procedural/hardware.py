"""What comes from a hardware shop: fittings, fasteners, pipes and bricks."""

import numpy as np

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import polygon_outline
from clutter6d.assets.sources.procedural.primitives import bar, box, disc, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import BOX, HALF_TURN_X, SPOOL, Symmetry, prism, pyramid

HEXAGON = polygon_outline(6)


@family(small=(0.07, 0.2), large=(0.25, 0.32))
def l_bracket(draw: Draw) -> Design:
    """An angle bracket, with or without a gusset."""
    a, b = draw.size(0.07, 0.1), draw.size(0.05, 0.1)
    width, thickness = draw.size(0.025, 0.05), draw.size(0.004, 0.008)
    foot = box(a, width, thickness, rounding=0.002).at(x=a / 2)
    wall = box(thickness, width, b, rounding=0.002).at(x=thickness / 2)
    made_of = draw.one("steel", "steel", "plastic", "wood")
    colour = draw.colour(made_of)
    pieces = [Piece(foot + wall, made_of, colour)]
    if draw.chance(0.5):
        rib = slab([(0, 0), (a * 0.6, 0), (0, b * 0.6)], thickness, rounding=0.001).turn("x", 90)
        pieces.append(Piece(rib.at(x=thickness * 0.9, y=thickness / 2, z=thickness * 0.9), made_of, colour))
    else:
        head = disc(thickness * 1.1, thickness * 0.5, rounding=0.001)
        screws = [head.at(x=a * share, z=thickness * 0.9) for share in (0.45, 0.8)]
        pieces.append(Piece(weld(screws), "steel", "brass" if made_of != "steel" else "iron"))
    return Design(tuple(pieces))


@family(small=(0.09, 0.2), large=(0.25, 0.3))
def pipe_elbow(draw: Draw) -> Design:
    """A quarter bend of pipe with its two collars."""
    radius, bend = draw.size(0.018, 0.026), draw.size(0.035, 0.05)
    arc = [(bend * (1 - np.cos(t)), 0.0, bend * np.sin(t)) for t in np.linspace(0, np.pi / 2, 5)]
    tube = bar([(0, 0, -0.025), *arc, (bend + 0.025, 0, bend)], radius * 2)
    collar, hole = disc(radius * 1.25, 0.022), disc(radius * 0.95, 0.001, rounding=0.0003)
    holes = hole.at(z=-0.0425) + hole.turn("y", 90).at(x=bend + 0.0416, z=bend)
    ends = collar.at(z=-0.042) + collar.turn("y", 90).at(x=bend + 0.02, z=bend)
    made_of = draw.one("plastic", "brass", "steel")
    colour = draw.one("grey", "white", "orange", "graphite") if made_of == "plastic" else draw.colour(made_of)
    return Design((Piece(tube + ends, made_of, colour, 0.35), Piece(holes.seen_only(), made_of, "black", 0.1)))


@family(small=(0.1, 0.2), large=(0.25, 0.3))
def pipe_tee(draw: Draw) -> Design:
    """A tee of pipe."""
    radius, reach = draw.size(0.018, 0.026), draw.size(0.05, 0.065)
    run = disc(radius, reach * 1.7, rounding=0.001).at(z=-reach * 0.85)
    branch = disc(radius, reach * 0.85, rounding=0.001).turn("y", 90)
    collar = disc(radius * 1.28, reach * 0.4, rounding=0.003)
    ends = weld(
        [collar.at(z=reach * 0.6), collar.turn("x", 180).at(z=-reach * 0.6), collar.turn("y", 90).at(x=reach * 0.6)]
    )
    hole = disc(radius * 0.95, 0.001, rounding=0.0003).at(z=reach - 0.0006)
    holes = weld([hole, hole.turn("x", 180), hole.turn("y", 90)])
    made_of = draw.one("plastic", "brass", "steel")
    colour = draw.one("grey", "white", "orange", "blue") if made_of == "plastic" else draw.colour(made_of)
    fill = 0.55 if made_of == "plastic" else 0.35
    return Design(
        (
            Piece(run + branch, made_of, colour, fill),
            Piece(ends, made_of, colour, fill),
            Piece(holes.seen_only(), made_of, "black", 0.1),
        ),
        HALF_TURN_X,
    )


@family(small=(0.06, 0.2), large=(0.25, 0.3))
def spool(draw: Draw) -> Design:
    """A spool of thread, wire or cable."""
    radius, height, core = draw.size(0.03, 0.05), draw.size(0.045, 0.09), draw.size(0.5, 0.85)
    flange = disc(radius, height * 0.09, rounding=0.002)
    wound = disc(radius * core, height * 0.9, rounding=0.001).at(z=height * 0.05)
    made_of = draw.one("wood", "plastic")
    thread = draw.one("red", "navy", "copper", "mustard", "teal", "rose", "forest", "white", "violet")
    pieces = (
        Piece(flange + flange.at(z=height * 0.91), made_of, draw.colour(made_of)),
        Piece(wound, "fabric", thread, draw.one(1.5, 4.0)),
    )
    return Design(pieces, SPOOL)


@family(small=(0.07, 0.2))
def gear(draw: Draw) -> Design:
    """A spur gear with a hub."""
    teeth, radius, height = draw.count(8, 12), draw.size(0.03, 0.04), draw.size(0.01, 0.02)
    angle = np.pi / teeth
    tooth = slab(
        [
            (radius * 0.86, -radius * angle * 0.62),
            (radius * 1.16, -radius * angle * 0.36),
            (radius * 1.16, radius * angle * 0.36),
            (radius * 0.86, radius * angle * 0.62),
        ],
        height,
        rounding=0.001,
    )
    wheel = disc(radius * 0.93, height, rounding=0.001)
    hub = lathe([(radius * 0.36, -height * 0.35), (radius * 0.36, height * 1.35)], rounding=0.002)
    made_of = draw.one("steel", "plastic", "brass")
    colour = draw.colour(made_of)
    pieces = (
        Piece(wheel + weld([tooth.turn("z", 360 * i / teeth) for i in range(teeth)]), made_of, colour),
        Piece(hub, made_of, draw.one(colour, "graphite")),
    )
    return Design(pieces, prism(teeth))


@family(small=(0.06, 0.1))
def nut(draw: Draw) -> Design:
    """A large hexagonal nut."""
    radius = draw.size(0.03, 0.04)
    body = ring(radius, radius * draw.size(0.48, 0.6), radius * draw.size(0.7, 0.95), outline=HEXAGON)
    made_of = draw.one("steel", "brass", "plastic")
    return Design((Piece(body, made_of, draw.colour(made_of)),), prism(6))


@family(small=(0.08, 0.2))
def bolt(draw: Draw) -> Design:
    """A hexagon bolt, threaded or plain, with or without a nut."""
    radius, length = draw.size(0.008, 0.012), draw.size(0.07, 0.11)
    head = lathe([(radius * 1.9, 0), (radius * 1.9, radius * 1.3)], outline=HEXAGON)
    washer = disc(radius * 2.1, 0.002, rounding=0.0005).at(z=radius * 1.3)
    shank = lathe([(radius, 0), (radius, length * 0.95), (radius * 0.8, length)], rounding=0.001).at(z=radius * 1.2)
    solids = [head, washer, shank]
    if draw.chance(0.6):
        nut_body = lathe([(radius * 1.8, 0), (radius * 1.8, radius * 1.5)], outline=HEXAGON)
        solids.append(nut_body.at(z=length * draw.size(0.55, 0.85)))
    made_of = draw.one("steel", "steel", "brass")
    return Design((Piece(weld(solids), made_of, draw.colour(made_of)),), pyramid(6))


@family(small=(0.14, 0.22), large=(0.25, 0.29))
def brick(draw: Draw) -> Design:
    """A brick: solid, or perforated."""
    x, y, z = draw.size(0.19, 0.24), draw.size(0.09, 0.115), draw.size(0.05, 0.07)
    colour = draw.one("brick", "terracotta", "sand", "grey")
    if draw.chance(0.5):
        return Design((Piece(box(x, y, z, rounding=0.004), "clay", colour, 0.7),), BOX)
    web, rail = box(x * 0.1, y * 0.96, z, rounding=0.002), box(x, y * 0.22, z, rounding=0.004)
    webs = weld([web.at(x=x * share) for share in (-0.45, -0.15, 0.15, 0.45)])
    rails = rail.at(y=y * 0.39) + rail.at(y=-y * 0.39)
    return Design((Piece(rails + webs, "clay", colour, 0.8),), BOX)


@family(small=(0.1, 0.24), large=(0.25, 0.35))
def pipe(draw: Draw) -> Design:
    """A straight piece of pipe."""
    radius, length = draw.size(0.014, 0.03), draw.size(0.12, 0.25)
    made_of = draw.one("plastic", "brass", "steel", "cardboard")
    tube = ring(radius, radius * draw.size(0.72, 0.85), length, sectors=8).turn("y", 90)
    fill = {"brass": 0.6, "steel": 0.6}.get(made_of, 1.0)
    return Design((Piece(tube, made_of, draw.colour(made_of), fill),), Symmetry((("z", 2),), continuous="x"))


@family(small=(0.09, 0.2), large=(0.25, 0.3))
def hinge(draw: Draw) -> Design:
    """A butt hinge, half open."""
    length, width, thickness = draw.size(0.09, 0.12), draw.size(0.04, 0.06), draw.size(0.004, 0.006)
    leaf = box(length, width, thickness, rounding=0.001).at(y=width / 2)
    pin = disc(thickness * 1.1, length * 1.06, rounding=0.001).turn("y", 90).at(x=-length * 0.53, z=thickness * 0.9)
    opening = draw.size(40, 140)
    other = leaf.at(z=-thickness * 0.9).turn("x", opening).at(z=thickness * 0.9)
    made_of = draw.one("brass", "steel")
    return Design((Piece(weld([leaf, other, pin]), made_of, draw.colour(made_of)),))


@family(small=(0.08, 0.16))
def hand_wheel(draw: Draw) -> Design:
    """A valve's hand wheel: rim, spokes and hub."""
    radius = draw.size(0.04, 0.06)
    rim = ring(radius, radius * 0.78, 0.014, sectors=10)
    spokes = draw.count(3, 4)
    spoke = box(radius * 0.85, 0.01, 0.009, rounding=0.002).at(x=radius * 0.42, z=0.0025)
    hub = disc(0.013, 0.024, rounding=0.002).at(z=-0.002)
    colour = draw.one("red", "blue", "yellow", "iron", "green")
    arms = weld([spoke.turn("z", 360 * i / spokes) for i in range(spokes)])
    return Design(
        (Piece(rim + arms, "iron", colour, 0.8), Piece(hub, "steel", draw.one("steel", "iron"))), pyramid(spokes)
    )
