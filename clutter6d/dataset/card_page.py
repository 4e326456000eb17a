"""The text of a data card, in the order of a datasheet: what is in it, how hard, how made, uses, limits, licence, care.

The habit is that of datasheets and data cards, kept short; every number is measured, none is typed.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from clutter6d.dataset.card_tables import (
    count_shared_assets,
    failure_table,
    figure_table,
    licence_table,
    markdown_table,
    material_table,
    pool_table,
    split_table,
)
from clutter6d.dataset.measurement import Measurements

SHEET_OF = "sheet: "
ASSETS_OF = "assets: "


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class CardContent:
    """Everything that a card says.

    Attributes:
        name: Of the data set.
        facts: How it was made, as names and values: seed, versions, hashes.
        measured: What was measured of each split, by the split's name.
        hashes: SHA-256 of each split.
        assets: One row an asset, with the columns of a library's index and ``pool``.
        failures: Failed draws of each split by reason; empty where nobody counted.
        pictures: Where the pictures lie relative to the page, by what they show.
    """

    name: str
    facts: Sequence[tuple[str, str]]
    measured: Mapping[str, Measurements]
    hashes: Mapping[str, str]
    assets: pd.DataFrame
    failures: Mapping[str, Mapping[str, int]]
    pictures: Mapping[str, str]

    def picture(self, title: str, caption: str) -> str:
        """Markdown that shows a picture; nothing if it was not drawn."""
        return f"![{caption}]({self.pictures[title]})" if title in self.pictures else ""

    def pictures_of(self, prefix: str) -> dict[str, str]:
        """Markdown of all pictures whose title begins so, by the rest of the title."""
        titles = [title for title in self.pictures if title.startswith(prefix)]
        return {title.removeprefix(prefix): self.picture(title, title) for title in titles}


def make_page(content: CardContent) -> str:
    """The whole card as Markdown."""
    sections = (_opening, _splits, _difficulty, _clutter, _assets, _making, _uses, _limits, _licences, _maintenance)
    return "\n\n".join(section(content).strip() for section in sections) + "\n"


def _opening(content: CardContent) -> str:
    return f"""\
<!-- Written by "clutter6d dataset card": every number is measured. Do not edit by hand. -->

# Data card: {content.name}

Scenes for moving one object among others to a 6-D pose without grasping it: tabletops at rest, each with goal pairs
that say where the target starts and where it must go. The benchmark's page says what tracks, splits and scores are;
this card says what is in the data, how hard it is, how it was made, and where its limits are."""


def _splits(content: CardContent) -> str:
    shared = count_shared_assets(content.measured)
    sentence = "" if shared is None else f"Assets that appear in scenes of both train and test splits: {shared}."
    return f"## What is in it\n\n{split_table(content.measured)}\n\n{sentence}"


def _difficulty(content: CardContent) -> str:
    return f"""\
## How hard it is

{figure_table(content.measured, "difficulty")}

{content.picture("difficulty", "Shares of goals by what they take")}

*Planar*: a turn about the vertical brings the target within 0.1 rad of the goal's orientation, so that a push along the
table can give it. *Another resting face*: what pointed up at the start points up no longer, by more than 10°. *Symmetry
allowed*: any goal that looks alike counts, so that a can may roll; official success asks for the goal itself.
*Blocked*: an obstacle's footprint overlaps what the target's footprint sweeps on the straight line to the goal; large
and small obstacles may both be in the way. *Heavier*: than the target.

{content.picture("goals", "Distances, rotations and tilts from start to goal")}

*Tilt* is the angle that is left of the rotation when the best turn about the vertical is undone."""


def _clutter(content: CardContent) -> str:
    shown = [f"### {split}: first scenes\n\n{text}" for split, text in content.pictures_of(SHEET_OF).items()]
    sheets = "\n\n".join(shown)
    return f"""\
## How cluttered it is

{figure_table(content.measured, "clutter")}

{content.picture("clutter", "Gaps and coverage")}

A gap is the free distance to the nearest obstacle, between convex footprints seen from above. The clutter region is
where the track lets obstacles stand; covered is what lies under a footprint. In the pictures the green ghost is the
goal of a scene's first pair.

{sheets}"""


def _assets(content: CardContent) -> str:
    shown = [f"Pool {pool}:\n\n{text}" for pool, text in content.pictures_of(ASSETS_OF).items()]
    sheets = "\n\n".join(shown)
    return f"""\
## Assets

{pool_table(content.assets)}

{content.picture("assets", "Sizes, masses, parts and resting orientations")}

{material_table(content.assets)}

{_families(content.assets)}

{sheets}"""


def _families(assets: pd.DataFrame) -> str:
    """The families of each pool with their counts, folded away."""
    folded: list[str] = []
    for pool, group in assets.groupby("pool", sort=False):
        counts = sorted(Counter(group["category"]).items())
        names = ", ".join(f"{name} {count}" for name, count in counts)
        folded.append(f'??? note "Pool {pool}: its {len(counts)} families, with their assets"\n\n    {names}')
    return "\n\n".join(folded)


def _making(content: CardContent) -> str:
    facts = markdown_table(("", ""), [(name, f"`{value}`") for name, value in content.facts], text_columns=(0, 1))
    failures = failure_table(content.measured, content.failures)
    return f"""\
## How it was made

Assets: a mesh becomes watertight, its convex parts are found, its mass properties computed, and its resting
orientations proposed by geometry and kept only if they hold in simulation. Scenes: a scene graph is drawn, objects are
placed in its order without overlap, and every state is settled in simulation and checked. Every draw is keyed by seed,
track and scene, so that each scene regenerates alone, to the bit.

{facts}

### What was thrown away

{failures or "Nobody counted."}

Failed draws by reason, in brackets for each scene that was kept. A draw is an attempt at a whole scene, or one state of
a goal pair; what fails is drawn again.

### Certificates

The worst over all stored states of all scenes. Allowed are 1 mm, 1 mm and 1°.

{figure_table(content.measured, "certificate")}"""


def _uses(_content: CardContent) -> str:
    return """\
## Uses

Meant for training and comparing policies that push, topple and slide among obstacles, for measuring how much they
disturb what stands around, and for studying one degree of clutter against another. Not meant for claims about real
robots without trials on one, nor for training, tuning or choosing checkpoints on a test split."""


def _limits(content: CardContent) -> str:
    limits = [
        "*Planar* says that a push could give the goal's orientation, not that a given arm and policy can make that "
        "push. Another resting face may be one easy topple away, or several.",
        "*Blocked* looks from above at convex footprints, along 64 directions: what a taller target could pass over, "
        "the inside of a ring, and a near miss of some millimetres count as in the way, and gaps are never overstated. "
        "A free path is no promise that the hand finds room behind the target.",
        "Initial orientations are drawn evenly from the stable ones, goals as often as a dropped object rests in them: "
        "most goals ask for another resting face.",
        "Goal pairs of one scene share its obstacles. For statements about clutter the sample is the scene.",
        "Objects are rigid, of uniform density, made of convex parts, and stand on one table; nothing is stacked, "
        "soft, jointed or filled. Friction is one number an object.",
        "Mass, material and friction come from an asset's source or from rules, not from scales.",
    ]
    if "procedural" in set(content.assets["source"]):
        limits.append(
            "Built-in objects are drawn from parametric families: the proportions of household things, without their "
            "wear and their labels."
        )
    return "## Known limits\n\n" + "\n".join(f"- {limit}" for limit in limits)


def _licences(content: CardContent) -> str:
    return f"""\
## Licences and attribution

{licence_table(content.assets)}

Author, source and licence of every single asset travel with it, and the data set's asset list names them."""


def _maintenance(content: CardContent) -> str:
    hashes = [(name, f"`{value}`") for name, value in content.hashes.items()]
    return f"""\
## Maintenance

What is frozen is never edited: a mistake found later is listed here and mended in a new version under a new name.
A table of scores names the hash of its split:

{markdown_table(("split", "SHA-256"), hashes, text_columns=(0, 1))}"""
