"""A policy at work on all goal pairs of some scenes, recorded until there are enough steps."""

from collections.abc import Iterator
from pathlib import Path

from clutter6d import __version__
from clutter6d.dataset.scenes import SceneCollection
from clutter6d.errors import InvalidValueError
from clutter6d.eval.evaluator import ENGINE, EvaluationConfig, episode_keys
from clutter6d.eval.policy import Policy, is_planner
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.interactions.recorder import record_episodes, shuffled_keys
from dapl_baselines.interactions.recording import Recording
from dapl_baselines.interactions.shards import RecordingHeader
from dapl_baselines.interactions.sweep import SweepPolicy
from dapl_baselines.validation import part_scenes

_PARALLEL_EPISODES = 16


class PolicyRecording:
    """A policy's recording in a data set, new or continued; what it holds does not depend on interruptions.

    Args:
        scenes: All scenes; those that are held out are recorded too, and marked.
        policy: What acts.
        out: Folder of the data set.
        scenes_name: The scenes, as the user named them.
        seed: Of the order of the episodes, and of what the policy draws.
        max_steps: Control steps of an episode at most.
        parallel: Episodes that run at once; ``None``: as many as suit the policy.
        threads: Threads of the simulation; 0 for all cores.

    Attributes:
        folder: The recording's own, in ``out``.

    Raises:
        InvalidValueError: The scenes are a test split's or of several tracks; or the folder holds something else.
        InvalidFileError: A file in it is damaged.
        StorageError: It cannot be written.
    """

    def __init__(
        self,
        scenes: SceneCollection,
        policy: Policy,
        out: Path,
        *,
        scenes_name: str,
        seed: int,
        max_steps: int,
        parallel: int | None = None,
        threads: int = 0,
    ) -> None:
        header = _make_header(scenes, policy, scenes_name, seed=seed, max_steps=max_steps)
        self.folder = out / f"{policy.name}-{header.policy_hash[:8]}-seed{seed}"
        self._recording = Recording(self.folder, header)
        self._keys = shuffled_keys(episode_keys(scenes, None), seed)
        self._runner = EpisodeRunner(
            scenes,
            policy,
            config=EvaluationConfig(max_steps=max_steps).env(),
            seed=seed,
            num_envs=parallel or _parallel_episodes(policy),
            threads=threads,
        )

    @property
    def steps(self) -> int:
        """Control steps recorded."""
        return self._recording.steps

    @property
    def episodes(self) -> int:
        """Episodes recorded."""
        return len(self._recording.keys)

    def run(self, steps: int) -> Iterator[int]:
        """Record whole episodes until there are so many steps, or no more episodes.

        Yields:
            The steps there are, after each episode.
        """
        done, total = self._recording.keys, self.steps
        if total >= steps:
            return
        for episode in record_episodes(self._runner, [key for key in self._keys if key not in done]):
            self._recording.add(episode)
            total += len(episode.actions)
            yield total
            if total >= steps:
                return


def _parallel_episodes(policy: Policy) -> int:
    """A policy that plans takes seconds an episode, so it runs one at a time: a kill then loses one, not sixteen."""
    return 1 if is_planner(policy) and not isinstance(policy, SweepPolicy) else _PARALLEL_EPISODES


def _make_header(scenes: SceneCollection, policy: Policy, where: str, *, seed: int, max_steps: int) -> RecordingHeader:
    objects = {len(scene.objects) for scene in scenes.scenes}
    if len(objects) != 1:
        raise InvalidValueError(f"{where} has scenes of {sorted(objects)} objects; record those of one track")
    return RecordingHeader(
        policy=policy.name,
        policy_hash=policy.policy_hash,
        scenes=where,
        split_sha256=scenes.sha256,
        validation_scenes=tuple(scene.scene_id for scene in part_scenes(scenes).validation.scenes),
        objects=objects.pop(),
        seed=seed,
        max_steps=max_steps,
        engine=ENGINE,
        clutter6d=__version__,
    )
