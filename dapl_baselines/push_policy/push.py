"""A push as a row of numbers, which is how pushes are drawn, compared, stored and carried out by the hundred.

A push goes from a start to a contact on the target, and on from there in a straight line. Vectors are in world axes;
points are offsets from the target's origin, so that a push keeps its meaning when the table is moved.
"""

from typing import Final

CONTACT: Final = slice(0, 3)
"""Where the finger tips touch the target [m]."""
NORMAL: Final = slice(3, 6)
"""Outward unit normal there."""
DIRECTION: Final = slice(6, 9)
"""Unit vector of the movement from the contact on."""
START: Final = slice(9, 12)
"""Where the tips come down before they go to the contact [m]; of a segment, where they are."""
HAND: Final = slice(12, 16)
"""Quaternion that turns a hand pointing straight down into how it is held."""
LENGTH: Final = 16
"""How far the tips move beyond the contact [m]; of a segment, beyond the start."""
SPEED: Final = 17
"""Movement of the tips in a control step [m]."""
IS_SEGMENT: Final = 18
"""1 for a segment: a short straight movement from where the hand is, without going to a contact first."""

SIZE: Final = 19

VECTORS: Final = (CONTACT, NORMAL, DIRECTION, START)
