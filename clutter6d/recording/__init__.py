"""Recordings of episodes: videos, Parquet tables, LeRobot data sets."""

from clutter6d.recording.rollout import PointClouds, Rollout, RolloutStates
from clutter6d.recording.rollout_file import read_rollouts

__all__ = ["PointClouds", "Rollout", "RolloutStates", "read_rollouts"]
