"""What hangs in a workshop."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.primitives import bar, box, cup, disc, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import Solid, weld
from clutter6d.assets.sources.procedural.symmetry import HALF_TURN_X, HALF_TURN_Z, TURNED, TURNED_X


def grip_colours(draw: Draw) -> tuple[str, str, str]:
    """Material and colour of a tool's grip, and a second colour."""
    made_of = draw.one("wood", "rubber", "plastic")
    return made_of, draw.colour(made_of), draw.one("black", "graphite", "yellow", "red")


@family(small=(0.18, 0.24), large=(0.25, 0.34))
def hammer(draw: Draw) -> Design:
    """A claw hammer or a machinist's hammer."""
    length, size = draw.size(0.2, 0.27), draw.size(0.022, 0.028)
    face = (
        lathe([(size * 0.5, 0), (size * 0.62, 0.006), (size * 0.62, 0.02), (size * 0.42, 0.03)], rounding=0.003)
        .turn("x", 90)
        .at(y=0.062)
    )
    block = box(size * 1.1, 0.05, size, rounding=0.005).at(y=0.012, z=-size / 2)
    if draw.chance(0.6):
        claw_path = [(0, -0.01, 0), (0, -0.035, 0.0), (0.012, -0.07, 0)]
        claw = bar(claw_path, [size, size * 0.9, size], [size, size * 0.6, 0.004], side=(0, 0, 1), square=True).stretch(
            -1
        )
    else:
        claw = (
            slab([(-size / 2, 0), (size / 2, 0), (0.002, 0.045), (-0.002, 0.045)], size)
            .turn("z", 180)
            .at(y=-0.01, z=-size / 2)
        )
    path = [(-0.012, 0, 0), (length * 0.35, 0, 0), (length * 0.7, 0, 0), (length, 0, 0)]
    made_of, colour, second = grip_colours(draw)
    shaft = bar(path, [0.016, 0.017, 0.024, 0.026], [0.022, 0.022, 0.03, 0.032], side=(0, 0, 1), rounding=0.03)
    iron = Piece(weld([face, block, claw]), "steel", draw.one("steel", "iron", "graphite"), 0.85)
    return Design(
        (Piece(shaft, made_of, colour), iron, Piece(disc(0.013, 0.002).turn("y", 90).at(x=length), "plastic", second))
    )


@family(small=(0.15, 0.24), large=(0.25, 0.32))
def mallet(draw: Draw) -> Design:
    """A wooden or rubber mallet."""
    radius, width, length = draw.size(0.026, 0.034), draw.size(0.07, 0.1), draw.size(0.18, 0.24)
    made_of = draw.one("wood", "rubber")
    if draw.chance(0.5):
        head = disc(radius, width, rounding=0.005).turn("x", 90).at(y=width / 2)
    else:
        head = box(radius * 2.2, width, radius * 1.8, rounding=0.006).at(z=-radius * 0.9)
    shaft = lathe([(0.011, -radius), (0.0105, length * 0.6), (0.014, length)], rounding=0.01).turn("y", 90)
    return Design((Piece(head, made_of, draw.colour(made_of)), Piece(shaft, "wood", draw.colour("wood"))), HALF_TURN_X)


def jaw(mouth: float, thickness: float) -> Solid:
    """An open wrench jaw looking along +x, its neck at the origin."""
    outer = mouth * 0.95
    palm = slab(
        [(-mouth * 0.3, -mouth * 0.4), (mouth * 0.42, -outer), (mouth * 0.42, outer), (-mouth * 0.3, mouth * 0.4)],
        thickness,
    )
    tooth = slab(
        [(mouth * 0.4, mouth * 0.5), (mouth * 1.35, mouth * 0.5), (mouth * 1.2, mouth * 0.9), (mouth * 0.4, outer)],
        thickness,
    )
    return palm + tooth + tooth.stretch(y=-1)


@family(small=(0.14, 0.24), large=(0.25, 0.33))
def wrench(draw: Draw) -> Design:
    """A spanner: open at both ends, or open and ring."""
    length, mouth, thickness = draw.size(0.11, 0.14), draw.size(0.013, 0.017), draw.size(0.006, 0.008)
    shank = bar(
        [(0, 0, 0), (length / 2, 0, 0), (length, 0, 0)],
        [mouth * 1.1, mouth * 0.9, mouth * 1.1],
        thickness * 0.8,
        square=True,
        rounding=0.03,
    )
    near = jaw(mouth, thickness).turn("z", 15).turn("z", 180).at(z=-thickness / 2)
    eye = ring(mouth * 1.05, mouth * 0.62, thickness).at(x=length + mouth * 0.9, z=-thickness / 2)
    far = eye if draw.chance(0.6) else jaw(mouth * 0.85, thickness).turn("z", 15).at(x=length, z=-thickness / 2)
    return Design((Piece(weld([shank, near, far]), "steel", draw.one("steel", "steel", "iron", "graphite")),))


@family(small=(0.15, 0.24), large=(0.25, 0.31))
def screwdriver(draw: Draw) -> Design:
    """A screwdriver with a bulbous grip."""
    radius, grip, blade = draw.size(0.013, 0.018), draw.size(0.085, 0.105), draw.size(0.09, 0.14)
    profile = [
        (radius * 0.6, 0),
        (radius, grip * 0.2),
        (radius * 0.92, grip * 0.65),
        (radius * 0.58, grip * 0.85),
        (radius * 0.66, grip),
    ]
    handle = lathe(profile, rounding=0.02)
    band = lathe([(radius * 0.985, grip * 0.32), (radius * 0.955, grip * 0.46)], rounding=0.0005)
    rod = lathe([(0.0035, grip - 0.002), (0.0035, grip + blade)], rounding=0.0005)
    point = bar(
        [(0, 0, grip + blade - 0.004), (0, 0, grip + blade + 0.009)],
        [0.0065, 0.008],
        [0.0065, 0.0016],
        side=(0, 1, 0),
        square=True,
    )
    made_of, colour, second = (
        draw.one("plastic", "rubber"),
        draw.one("red", "yellow", "blue", "orange", "green", "amber"),
        "black",
    )
    pieces = (
        Piece(handle, made_of, colour),
        Piece(band.seen_only(), made_of, second, 0.05),
        Piece(rod + point, "steel", "steel"),
    )
    return Design(pieces, HALF_TURN_X).turn("y", 90)


@family(small=(0.12, 0.24), large=(0.25, 0.3))
def torch(draw: Draw) -> Design:
    """A pocket torch: a flashlight."""
    radius, length = draw.size(0.014, 0.019), draw.size(0.12, 0.18)
    head = radius * draw.size(1.4, 1.8)
    profile = [(radius * 0.9, 0), (radius, 0.008), (radius, length * 0.7), (head, length * 0.84), (head, length)]
    body = lathe(profile, rounding=0.004)
    grip = lathe([(radius * 1.03, length * 0.2), (radius * 1.03, length * 0.55)], rounding=0.001)
    lens = disc(head * 0.88, 0.003, rounding=0.0005).at(z=length - 0.001)
    colour = draw.one("graphite", "black", "red", "yellow", "blue", "steel")
    made_of = draw.one("aluminium", "plastic")
    pieces = (
        Piece(body, made_of, colour, 0.6),
        Piece(grip.seen_only(), "rubber", "black", 0.05),
        Piece(lens.seen_only(), "glass", "clear", 0.5),
    )
    return Design(pieces, TURNED_X).turn("y", 90)


@family(small=(0.15, 0.24), large=(0.25, 0.3))
def paint_brush(draw: Draw) -> Design:
    """A flat paint brush."""
    width, thickness = draw.size(0.04, 0.065), draw.size(0.012, 0.016)
    handle = bar(
        [(-0.13, 0, 0), (-0.08, 0, 0), (-0.03, 0, 0), (0, 0, 0)],
        [0.02, 0.026, 0.02, width * 0.9],
        [0.012, 0.014, 0.011, 0.012],
        rounding=0.02,
    )
    ferrule = box(0.035, width, thickness, rounding=0.002).at(x=0.016, z=-thickness / 2)
    bristles = bar(
        [(0.03, 0, 0), (0.06, 0, 0), (0.085, 0, 0)],
        width * 0.96,
        [thickness * 0.9, thickness * 0.95, 0.004],
        square=True,
        rounding=0.02,
    )
    dipped = draw.one("sand", "graphite", "brown", "white")
    handle_piece = Piece(handle, "wood", draw.one("pine", "red", "oak", "yellow", "blue"))
    return Design(
        (handle_piece, Piece(ferrule, "steel", draw.one("steel", "brass"), 0.15), Piece(bristles, "fabric", dipped)),
        HALF_TURN_X,
    )


@family(small=(0.14, 0.22), large=(0.25, 0.33))
def trowel(draw: Draw) -> Design:
    """A mason's trowel with a pointed blade."""
    length, width = draw.size(0.12, 0.16), draw.size(0.075, 0.1)
    blade = slab(
        [(0, -width * 0.32), (length * 0.3, -width / 2), (length, 0), (length * 0.3, width / 2), (0, width * 0.32)],
        0.0025,
        rounding=0.012,
    )
    neck = bar([(0.02, 0, 0.002), (-0.015, 0, 0.012), (-0.02, 0, 0.035), (-0.04, 0, 0.04)], 0.009, rounding=0.01)
    grip = (
        lathe([(0.01, 0), (0.013, 0.02), (0.014, 0.07), (0.01, 0.1)], rounding=0.012)
        .turn("y", -90)
        .at(x=-0.035, z=0.04)
    )
    made_of, colour, _ = grip_colours(draw)
    return Design((Piece(blade + neck, "steel", "steel"), Piece(grip, made_of, colour)))


@family(small=(0.14, 0.24), large=(0.25, 0.34))
def spirit_level(draw: Draw) -> Design:
    """A short spirit level with its vial."""
    length, height, width = draw.size(0.2, 0.3), draw.size(0.04, 0.052), draw.size(0.018, 0.024)
    rails = box(length, width, 0.007, rounding=0.002) + box(length, width, 0.007, rounding=0.002).at(z=height - 0.007)
    web = box(length * 0.98, width * 0.45, height - 0.008, rounding=0.001).at(z=0.004)
    ends = box(0.012, width * 1.02, height * 1.02, rounding=0.003).at(z=-height * 0.01)
    caps = ends.at(x=length / 2) + ends.at(x=-length / 2)
    vial = disc(0.006, 0.04, rounding=0.003).turn("y", 90).at(x=-0.02, z=height - 0.0075)
    colour = draw.one("yellow", "red", "blue", "orange", "steel")
    pieces = (
        Piece(rails + web, "aluminium", colour, 0.4),
        Piece(caps, "plastic", "black"),
        Piece(vial, "plastic", "lime"),
    )
    return Design(pieces, HALF_TURN_Z)


@family(small=(0.14, 0.2))
def pliers(draw: Draw) -> Design:
    """Combination pliers, closed."""
    nose = slab(
        [(0, -0.0115), (0.012, -0.014), (0.055, -0.006), (0.055, 0.006), (0.012, 0.014), (0, 0.0115)],
        0.011,
        rounding=0.004,
    )
    pivot = disc(0.009, 0.014, rounding=0.002).at(x=0.004, z=-0.0015)
    spread = draw.size(0.024, 0.034)
    path = [(0.008, 0.006, 0), (-0.03, spread * 0.75, 0), (-0.075, spread, 0), (-0.115, spread * 0.85, 0)]
    leg = bar(path, [0.01, 0.011, 0.011, 0.01], [0.013, 0.012, 0.014, 0.013], side=(0, 0, 1)).at(z=0.0055)
    grips = leg + leg.stretch(y=-1)
    colour = draw.one("red", "blue", "orange", "yellow", "green")
    return Design(
        (Piece(nose + pivot, "steel", draw.one("steel", "iron")), Piece(grips, "rubber", colour, 3.5)), HALF_TURN_X
    )


@family(small=(0.065, 0.11))
def socket(draw: Draw) -> Design:
    """A long hexagonal socket for a ratchet."""
    radius, length = draw.size(0.014, 0.019), draw.size(0.06, 0.08)
    body = cup(
        [(radius * 0.8, 0), (radius, length * 0.35), (radius, length)],
        wall=radius * 0.28,
        floor=length * 0.3,
        sectors=8,
    )
    return Design((Piece(body, "steel", draw.one("steel", "iron")),), TURNED)
