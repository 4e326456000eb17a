"""What stands on the window sill and among the plants."""

from clutter6d.assets.sources.procedural.design import Design, Draw, Piece
from clutter6d.assets.sources.procedural.family import family
from clutter6d.assets.sources.procedural.outline import polygon_outline
from clutter6d.assets.sources.procedural.primitives import ROUND, bar, box, cup, disc, lathe, ring, slab
from clutter6d.assets.sources.procedural.solid import weld
from clutter6d.assets.sources.procedural.symmetry import TURNED, pyramid


@family(small=(0.14, 0.24), large=(0.25, 0.34))
def vase(draw: Draw) -> Design:
    """A vase: bellied, waisted or faceted."""
    radius, height = draw.size(0.045, 0.06), draw.size(0.16, 0.22)
    shapes = (
        [(radius * 0.65, 0), (radius, height * 0.35), (radius * 0.5, height * 0.78), (radius * 0.62, height)],
        [(radius * 0.6, 0), (radius * 0.8, height * 0.25), (radius, height * 0.7), (radius * 0.55, height)],
        [(radius * 0.85, 0), (radius * 0.5, height * 0.45), (radius, height)],
    )
    shape = draw.one(*shapes)
    made_of = draw.one("ceramic", "ceramic", "glass", "wood")
    sides = draw.one(0, 0, 6)
    section = polygon_outline(sides, 0.1) if sides else ROUND
    body = lathe(shape, rounding=0.05, edge=0.004, outline=section)
    mouth = disc(shape[-1][0] * 0.8, 0.002, rounding=0.0005).at(z=height - 0.001)
    pieces = (Piece(body, made_of, draw.colour(made_of), 0.4), Piece(mouth.seen_only(), made_of, "black", 0.05))
    return Design(pieces, pyramid(sides) if sides else TURNED)


@family(small=(0.07, 0.2), large=(0.25, 0.3))
def candle(draw: Draw) -> Design:
    """A pillar candle or a taper, with its wick."""
    radius, height = draw.size(0.018, 0.032), draw.size(0.07, 0.2)
    body = lathe([(radius, 0), (radius, height)], rounding=0.004)
    wick = lathe([(0.0015, height - 0.001), (0.001, height + 0.01)], rounding=0.0002)
    return Design((Piece(body, "wax", draw.colour("wax")), Piece(wick, "fabric", "graphite")), TURNED)


@family(small=(0.1, 0.16), large=(0.25, 0.28))
def candle_stick(draw: Draw) -> Design:
    """A turned candlestick with a candle."""
    foot = draw.size(0.036, 0.046)
    profile = [
        (foot, 0),
        (foot * 0.9, 0.01),
        (0.012, 0.022),
        (0.016, 0.05),
        (0.009, 0.08),
        (0.02, 0.098),
        (0.02, 0.108),
    ]
    candle_body = lathe([(0.011, 0.1), (0.0105, draw.size(0.18, 0.23))], rounding=0.002)
    made_of = draw.one("brass", "wood", "ceramic")
    return Design(
        (
            Piece(lathe(profile, rounding=0.006), made_of, draw.colour(made_of), 0.7),
            Piece(candle_body, "wax", draw.colour("wax")),
        ),
        TURNED,
    )


@family(small=(0.18, 0.24), large=(0.25, 0.34))
def watering_can(draw: Draw) -> Design:
    """A watering can with spout, rose and bow."""
    radius, height = draw.size(0.052, 0.062), draw.size(0.09, 0.12)
    body = lathe([(radius, 0), (radius * 0.97, height * 0.85), (radius * 0.7, height)], rounding=0.012)
    tip = (radius + 0.085, 0, height * 1.15)
    spout = bar([(radius * 0.8, 0, height * 0.2), (radius + 0.035, 0, height * 0.5), tip], [0.026, 0.02, 0.014])
    rose = lathe([(0.008, -0.006), (0.02, 0.014), (0.02, 0.018)], rounding=0.002).turn("y", 42).at(*tip)
    path = [
        (radius * 0.4, 0, height * 0.97),
        (-radius * 0.1, 0, height * 1.5),
        (-radius * 1.5, 0, height * 1.2),
        (-radius * 0.96, 0, height * 0.25),
    ]
    bow = bar(path, 0.013, 0.009)
    made_of = draw.one("steel", "plastic", "plastic")
    colour = (
        draw.one("steel", "copper", "sage")
        if made_of == "steel"
        else draw.one("green", "forest", "yellow", "red", "teal", "pink")
    )
    fill = draw.one(0.06, 0.03) if made_of == "steel" else draw.one(0.15, 0.6)
    return Design(
        (Piece(body + spout, made_of, colour, fill), Piece(bow + rose, made_of, draw.one(colour, "graphite"), fill))
    )


@family(small=(0.08, 0.18), large=(0.25, 0.29))
def plant_pot(draw: Draw) -> Design:
    """A flower pot with a rim, empty."""
    radius, height = draw.size(0.05, 0.06), draw.size(0.075, 0.105)
    body = cup([(radius * 0.66, 0), (radius * 0.96, height)], wall=0.005, floor=0.007, sectors=7)
    collar = ring(radius * 1.06, radius * 0.88, height * 0.2, sectors=7).at(z=height * 0.82)
    made_of = draw.one("clay", "clay", "ceramic", "plastic")
    colour = draw.one("terracotta", "brick", "sand") if made_of == "clay" else draw.colour(made_of)
    return Design((Piece(body, made_of, colour), Piece(collar, made_of, colour)), TURNED)


@family(small=(0.14, 0.2))
def piggy_bank(draw: Draw) -> Design:
    """A pig of clay for coins."""
    belly = (
        lathe([(0.022, -0.062), (0.045, -0.035), (0.047, 0.03), (0.028, 0.062)], rounding=0.04)
        .turn("y", 90)
        .at(z=0.062)
    )
    snout = lathe([(0.02, 0), (0.0175, 0.022)], rounding=0.003).turn("y", 90).at(x=0.056, z=0.062)
    leg = lathe([(0.012, 0), (0.014, 0.034)], rounding=0.002)
    legs = weld([leg.at(x, y) for x in (-0.034, 0.034) for y in (-0.022, 0.022)])
    ear = slab([(-0.011, 0), (0.011, 0), (0, 0.022)], 0.006, rounding=0.002).turn("x", 90).turn("z", 90)
    ears = weld([ear.turn("x", -angle).at(x=0.036, y=y, z=0.1) for angle, y in ((-18, -0.02), (18, 0.02))])
    slot = box(0.034, 0.004, 0.002, rounding=0.001).at(z=0.1075)
    tail = bar([(-0.06, 0, 0.068), (-0.072, 0, 0.078), (-0.074, 0, 0.092)], 0.007)
    colour = draw.one("pink", "rose", "white", "sky", "terracotta", "mint")
    pieces = (
        Piece(weld([belly, legs, ears, tail]), "ceramic", colour, 0.4),
        Piece(snout, "ceramic", draw.one(colour, "rose"), 0.6),
        Piece(slot.seen_only(), "ceramic", "graphite", 0.1),
    )
    return Design(pieces)
