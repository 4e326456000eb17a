"""Procedural objects: parametric families of household and workshop things, built from convex solids."""

from clutter6d.assets.sources.procedural.family import Family
from clutter6d.assets.sources.procedural.source import FAMILIES, ProceduralSource

__all__ = ["FAMILIES", "Family", "ProceduralSource"]
