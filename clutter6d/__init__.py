"""Clutter6D: scenes, simulation and evaluation for 6-D object rearrangement in clutter."""

__version__ = "0.1.0"
