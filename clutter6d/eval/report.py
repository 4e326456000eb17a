"""The table: what an evaluation found, with everything that a number needs to be believed."""

from collections import Counter
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import Field

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.metrics import bootstrap_interval, wilson_interval
from clutter6d.schema import FileModel

OFFICIAL_PAIRS = 16
OFFICIAL_SPLITS = {
    "sparse": "fa85f3b14e5681490af2087bb2cbe47f822411e3764369f7f3ceecedfc8d7715",
    "moderate": "5d591f8fe74df27975d65bc37d23cdb67fecf2dbbc28aec7ef5d8048ff836350",
    "dense": "8dc86b90a431afb237e211e1ee88be9c2b28109ddbda385bd1e2db1d2a834467",
}
"""SHA-256 of the test splits of Clutter6D v1, by track."""
Label = Literal["official", "quick", "sample", "not official"]


class RunSettings(FileModel):
    """Everything that the outcome of an evaluation depends on; ``run.json``.

    Attributes:
        policy: Name of the policy.
        policy_hash: SHA-256 of the policy.
        policy_is_privileged: Whether the policy reads the simulation's full state.
        tracks: Tracks of the scenes.
        split_sha256: Hash of the set of scenes.
        scenes: Number of scenes in it.
        pairs: Goal pairs of each scene that are attempted; the first ones.
        sample: Scenes that are attempted, drawn at random and the same for everyone; ``None`` for all.
        seed: Seed of the evaluation.
        max_steps: Control steps of an episode at most.
        action_scale_rad: Largest joint residual.
        max_hand_step_m: Bound of the Cartesian clipping.
        damping: Damping of the Cartesian clipping.
        engine: The simulation engine and its version.
        clutter6d: Version of this package.
    """

    schema_version: Literal[1] = 1
    policy: str
    policy_hash: str
    policy_is_privileged: bool
    tracks: tuple[str, ...]
    split_sha256: str
    scenes: int = Field(ge=1)
    pairs: int = Field(ge=1)
    sample: int | None = Field(default=None, ge=1)
    seed: int
    max_steps: int = Field(ge=1)
    action_scale_rad: float = Field(gt=0)
    max_hand_step_m: float = Field(gt=0)
    damping: float = Field(ge=0)
    engine: str
    clutter6d: str

    def env_config(self) -> EnvConfig:
        """How actions are mapped, and when an episode ends."""
        action = ActionConfig(
            action_scale_rad=self.action_scale_rad, max_hand_step_m=self.max_hand_step_m, damping=self.damping
        )
        return EnvConfig(action=action, termination=TerminationConfig(max_steps=self.max_steps))

    @property
    def label(self) -> Label:
        """``official`` for all pairs of a frozen test split, ``quick`` for fewer, ``sample`` for fewer scenes.

        Anything else is ``not official``.
        """
        is_frozen = len(self.tracks) == 1 and OFFICIAL_SPLITS.get(self.tracks[0]) == self.split_sha256
        if not is_frozen or self.env_config() != EnvConfig():
            return "not official"
        if self.sample is not None and self.sample < self.scenes:
            return "sample"
        return "official" if self.pairs == OFFICIAL_PAIRS else "quick"


class Report(FileModel):
    """What an evaluation found; ``report.json``. Intervals are 95%.

    Attributes:
        settings: Everything that the numbers depend on.
        label: Official, quick or not official.
        policy: Name of the policy.
        policy_hash: SHA-256 of the policy.
        split_sha256: Hash of the set of scenes.
        engine: The simulation engine and its version.
        seed: Seed of the evaluation.
        episodes: Number of episodes.
        success_rate: Share of successes.
        success_interval: Its Wilson interval.
        planar_success_rate: Share that met the goal with its position taken on the table plane.
        symmetric_success_rate: Share that met the goal with the rotation error taken over the target's symmetries.
        hold_rate: Share of all episodes that succeeded and still stood 1 s after the robot stopped.
        outcomes: Episodes by outcome.
        mean_steps: Mean number of control steps.
        mean_offset_cm: Mean offset of the other objects.
        mean_offset_interval: Its bootstrap interval.
        zero_action_mean_offset_cm: Mean offset of a policy that does nothing on the same episodes: the floor.
    """

    schema_version: Literal[1] = 1
    settings: RunSettings
    label: Label
    policy: str
    policy_hash: str
    split_sha256: str
    engine: str
    seed: int
    episodes: int
    success_rate: float
    success_interval: tuple[float, float]
    planar_success_rate: float
    symmetric_success_rate: float
    hold_rate: float
    outcomes: dict[str, int]
    mean_steps: float
    mean_offset_cm: float
    mean_offset_interval: tuple[float, float]
    zero_action_mean_offset_cm: float


def make_report(settings: RunSettings, rows: Sequence[EpisodeRow], zero_action_mean_offset_cm: float) -> Report:
    """The report of finished episodes, in the table's order."""
    offsets = np.array([row.mean_offset_cm for row in rows])
    successes = sum(row.is_success for row in rows)
    return Report(
        settings=settings,
        label=settings.label,
        policy=settings.policy,
        policy_hash=settings.policy_hash,
        split_sha256=settings.split_sha256,
        engine=settings.engine,
        seed=settings.seed,
        episodes=len(rows),
        success_rate=successes / len(rows),
        success_interval=wilson_interval(successes, len(rows)),
        planar_success_rate=sum(row.is_planar_success for row in rows) / len(rows),
        symmetric_success_rate=sum(row.is_symmetric_success for row in rows) / len(rows),
        hold_rate=sum(row.holds for row in rows) / len(rows),
        outcomes=dict(sorted(Counter(str(row.outcome) for row in rows).items())),
        mean_steps=sum(row.steps for row in rows) / len(rows),
        mean_offset_cm=float(offsets.mean()),
        mean_offset_interval=bootstrap_interval(offsets, settings.seed),
        zero_action_mean_offset_cm=zero_action_mean_offset_cm,
    )


def to_table(report: Report) -> tuple[tuple[str, str], ...]:
    """The report as lines of a name and a value, as it is printed everywhere."""
    low, high = report.success_interval
    near, far = report.mean_offset_interval
    settings = report.settings
    return (
        ("evaluation", f"{report.label}: {_extent(settings)}"),
        ("policy", f"{report.policy}{' (privileged)' if settings.policy_is_privileged else ''}"),
        ("episodes", f"n = {report.episodes}"),
        ("success rate", f"{report.success_rate:.1%} (95% Wilson {low:.1%} to {high:.1%})"),
        ("planar success rate", f"{report.planar_success_rate:.1%}"),
        ("symmetry-aware success rate", f"{report.symmetric_success_rate:.1%}"),
        ("holds 1 s after the robot stops", f"{report.hold_rate:.1%}"),
        ("mean offset", f"{report.mean_offset_cm:.2f} cm (95% bootstrap {near:.2f} to {far:.2f})"),
        ("mean offset of zero action (floor)", f"{report.zero_action_mean_offset_cm:.2f} cm"),
        ("outcomes", ", ".join(f"{name} {count}" for name, count in report.outcomes.items())),
        ("mean steps", f"{report.mean_steps:.1f} of {settings.max_steps}"),
        ("split SHA-256", report.split_sha256),
        ("policy SHA-256", report.policy_hash),
        ("engine", f"{report.engine}, clutter6d {settings.clutter6d}"),
        ("seed", str(report.seed)),
    )


def _extent(settings: RunSettings) -> str:
    """Which episodes were run."""
    attempted = f"{settings.sample} sampled of {settings.scenes}" if settings.sample else f"{settings.scenes}"
    return f"{attempted} {'/'.join(settings.tracks)} scenes x {settings.pairs} pairs"


def to_markdown(report: Report) -> str:
    """The report as a Markdown page; ``report.md``."""
    lines = [f"| {name} | {value} |" for name, value in to_table(report)]
    title = f"# {report.policy} on {'/'.join(report.settings.tracks)} ({report.label})"
    return "\n".join([title, "", "| | |", "|---|---|", *lines, ""])
