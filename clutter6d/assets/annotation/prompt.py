"""What a vision-language model is asked; the paper has category, colour, material, mass and friction from one.

The words are ours. A change of the words is a new version: answers are remembered under it.
"""

import base64
from collections.abc import Sequence
from typing import Any

from clutter6d.assets.annotation.annotator import Png, Subject
from clutter6d.assets.annotation.volume import hull_volume_m3, solid_volume_m3
from clutter6d.assets.materials import COLOURS, MATERIALS

PROMPT_VERSION = "1"
_MAX_QUOTED = 4000

INSTRUCTIONS = f"""\
You describe household objects for a physics simulator. You see several views of one 3-D model on a light grey floor \
and are told its real size. Answer with one JSON object and nothing else, with these keys in this order:
- "reasoning": two short sentences: what the object is, what it is made of, whether it is hollow, and how heavy that \
makes it at its size
- "category": what it is, in 1 to 4 lower-case English words, the most common name, without brand, colour or material
- "colour": the colour of most of its surface, one of: {", ".join(COLOURS)}
- "material": what most of its mass consists of, one of: {", ".join(MATERIALS)}
- "mass_kg": mass of such an object in life at this size, in kilograms, empty if it is a container
- "friction": coefficient of sliding friction on a smooth wooden table, usually 0.2 to 0.9
Go by the views. The file's name is a hint that may be wrong."""

Message = dict[str, Any]


def first_messages(subject: Subject) -> list[Message]:
    """The instructions, what is measured of the asset, and its views."""
    pictures = [{"type": "image_url", "image_url": {"url": _data_url(view)}} for view in subject.views]
    content = [{"type": "text", "text": describe(subject)}, *pictures]
    return [{"role": "system", "content": INSTRUCTIONS}, {"role": "user", "content": content}]


def complaint_messages(text: str, complaint: str) -> list[Message]:
    """What the model said, and what is wrong with it."""
    ask = f"This cannot be used: {complaint}. Answer again: one complete JSON object with all six keys, nothing else."
    return [{"role": "assistant", "content": text[:_MAX_QUOTED] or "(nothing)"}, {"role": "user", "content": ask}]


def describe(subject: Subject) -> str:
    """What is measured of the asset; nothing of what is said of it so far."""
    asset = subject.asset
    sides = " x ".join(f"{100 * side:.1f}" for side in asset.extents_m)
    solid, hull = (_litres(volume) for volume in (solid_volume_m3(asset), hull_volume_m3(asset)))
    return (
        f"File name: {asset.name}\n"
        f"Size of the bounding box: {sides} cm\n"
        f"Volume of the model: {solid}; of its convex hull: {hull}. "
        "A model may be solid where the real object is hollow.\n"
        f"{len(subject.views)} views follow: all around it from slightly above, the last from high above."
    )


def _litres(volume_m3: float) -> str:
    return f"{1e6 * volume_m3:.0f} cubic centimetres" if volume_m3 < 1e-3 else f"{1e3 * volume_m3:.2f} litres"


def _data_url(view: Png) -> str:
    return f"data:image/png;base64,{base64.b64encode(view).decode()}"


def texts(subject: Subject) -> Sequence[str]:
    """All words of the question, for the key under which its answer is remembered."""
    return (PROMPT_VERSION, INSTRUCTIONS, describe(subject))
