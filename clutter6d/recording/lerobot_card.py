"""What introduces a recorded LeRobot data set: a text, and the licences of what is seen in it."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from clutter6d.recording.lerobot_features import FPS
from clutter6d.recording.recording import RecordingSettings

_TASKS_SHOWN = 10


def card_text(settings: RecordingSettings, episodes: int, frames: int, tasks: Sequence[str]) -> str:
    """``README.md`` of a data set.

    Args:
        settings: What was recorded.
        episodes: Number of episodes.
        frames: Number of frames of all episodes.
        tasks: The tasks as sentences.
    """
    run = settings.run
    cameras = ", ".join(settings.cameras) or "none"
    rest = f"- and {len(tasks) - _TASKS_SHOWN} more\n" if len(tasks) > _TASKS_SHOWN else ""
    return f"""---
license: other
task_categories:
- robotics
tags:
- LeRobot
configs:
- config_name: default
  data_files: data/*/*.parquet
---

# Clutter6D rollouts

{episodes:,} simulated episodes ({frames:,} frames at {FPS} a second) of a Franka arm that moves one object among many
to a 6-D goal pose without grasping it. LeRobot format v3.0; recorded by `clutter6d record`.

| | |
|---|---|
| policy | {run.policy} (`{run.policy_hash[:12]}`) |
| tracks | {", ".join(run.tracks)} |
| scenes | SHA-256 `{run.split_sha256[:12]}` |
| seed | {run.seed} |
| cameras | {cameras} |
| engine | {run.engine} |
| clutter6d | {run.clutter6d} |

A frame holds what was seen before an action, the action (joint residuals in radians, as the policy asked for them), and
under `next.` what came of it. `LICENCES.csv` names licence and author of every object that is seen.

Tasks:

{"".join(f"- {task}{chr(10)}" for task in tasks[:_TASKS_SHOWN])}{rest}"""


def join_licences(paths: Sequence[Path]) -> bytes:
    """Tables of scenes' licences as one, in which every asset stands once.

    Args:
        paths: What :func:`clutter6d.export.licences.licence_table` gave, a file each.
    """
    rows: dict[str, dict[str, str]] = {}
    for path in paths:
        for row in csv.DictReader(io.StringIO(path.read_text())):
            row.pop("object")
            rows[row["asset"]] = row
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(next(iter(rows.values()))), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows[name] for name in sorted(rows))
    return text.getvalue().encode()
