"""MuJoCo's compiled modules carry no types: every name of the top module is accepted, its submodules are read."""

from typing import Any

def __getattr__(name: str) -> Any: ...
