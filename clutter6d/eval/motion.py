"""How everything moved in a recorded episode, for looking at it."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64

from clutter6d.dataset.scenes import SceneCollection
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.slots import ClutterSlots
from clutter6d.errors import InvalidValueError
from clutter6d.eval.episode import EpisodeRow
from clutter6d.eval.evaluator import REPORT_FILE
from clutter6d.eval.report import Report
from clutter6d.eval.tables import read_actions, read_rows
from clutter6d.scene import Scene
from clutter6d.schema import read_model
from clutter6d.sim.scene_model import SceneModel, compile_stored_scene, joint_state


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EpisodeMotion:
    """One recorded episode, simulated again.

    Attributes:
        scene: The scene.
        row: The episode's row in the evaluation's table.
        qpos: Configuration at the start and at every control step's end; laid out as the simulator's.
    """

    scene: Scene
    row: EpisodeRow
    qpos: Float64[np.ndarray, "frame nq"]


def replay_motions(folder: Path, scenes: SceneCollection) -> Iterator[EpisodeMotion]:
    """Simulate the episodes of a finished evaluation again, one after another, in the table's order.

    Args:
        folder: What ``evaluate`` wrote.
        scenes: The scenes it was made on.

    Raises:
        MissingFileError: A file of the evaluation is missing.
        InvalidFileError: A file is damaged.
        InvalidValueError: The scenes are others.
    """
    settings = read_model(folder / REPORT_FILE, Report, what="report").settings
    rows, actions = read_rows(folder), read_actions(folder)
    by_id = {scene.scene_id: scene for scene in scenes.scenes}
    if settings.split_sha256 != scenes.sha256 or any(row.scene_id not in by_id for row in rows):
        raise InvalidValueError(
            f"the evaluation {folder} was made on other scenes (SHA-256 {settings.split_sha256[:12]}, these are "
            f"{scenes.sha256[:12]}); give the right ones by --scenes"
        )
    config = settings.env_config()
    for row in rows:
        scene = by_id[row.scene_id]
        model = compile_stored_scene(scene, scenes.assets_of(scene))
        qpos = simulate_motion(model, scene, row.pair, actions[row.key], config)
        yield EpisodeMotion(scene=scene, row=row, qpos=qpos)


def simulate_motion(
    model: SceneModel, scene: Scene, pair: int, actions: Float32[np.ndarray, "step 7"], config: EnvConfig | None = None
) -> Float64[np.ndarray, "frame nq"]:
    """Configurations at the start of a goal pair and after each action; ends where the simulation became unstable."""
    env, slot = ClutterSlots([model], config, threads=1), np.zeros(1, dtype=np.int64)
    env.load(slot, [model], [scene.goal_pairs[pair]])
    frames = [_configuration(env)]
    for action in actions:
        is_unstable = env.step(slot, action[None])[0]
        if is_unstable:
            break
        frames.append(_configuration(env))
    return np.stack(frames)


def _configuration(env: ClutterSlots) -> Float64[np.ndarray, "nq"]:
    return np.asarray(joint_state(env.batch.object_poses[0], env.batch.arm_qpos[0]), dtype=np.float64).copy()
