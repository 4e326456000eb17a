"""What a run left on disk, in a form that two runs can be compared by."""

import io
import json
from pathlib import Path
from typing import Any

import pandas as pd

TIMES = {"seconds", "timing_seconds"}
"""What may differ between two runs: how long things took."""


def tree(folder: Path) -> dict[str, Any]:
    """Every file below a folder with its content, times aside; what a kill left half written does not count."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".partial")
    return {str(path.relative_to(folder)): _content(path) for path in files}


def _content(path: Path) -> Any:
    content = path.read_bytes()
    if path.suffix == ".json":
        return _without_times(json.loads(content))
    if path.name == "episodes.parquet":
        return pd.read_parquet(io.BytesIO(content)).drop(columns=list(TIMES), errors="ignore").to_dict("records")
    return content


def _without_times(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_times(item) for key, item in value.items() if key not in TIMES}
    return [_without_times(item) for item in value] if isinstance(value, list) else value
