"""Colours: MuJoCo takes them as shown on a screen, USD and glTF as light intensities."""

from collections.abc import Iterable

import numpy as np


def srgb_to_linear(colour: Iterable[float]) -> tuple[float, float, float]:
    """Light intensities of a screen colour (IEC 61966-2-1)."""
    value = np.clip(np.array(list(colour), dtype=np.float64), 0, 1)
    red, green, blue = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return float(red), float(green), float(blue)
