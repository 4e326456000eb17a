"""Which episodes slots run one after another: task, physics and errors of the observation, drawn from named streams."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.randomisation import PhysicsDraw, draw_physics
from clutter6d.envs.slots import Slots
from clutter6d.envs.tasks import Task, TaskSource
from clutter6d.errors import InvalidValueError
from clutter6d.seeding import generator
from clutter6d.sim.model_variation import named_scales


@dataclass(frozen=True, kw_only=True, slots=True)
class StreamPlaces:
    """How far the streams of all slots are, and which episodes they run; one entry a slot.

    Attributes:
        seeds: The streams' seeds.
        numbers: Episodes begun since each was seeded.
        scene_ids: Scenes of the episodes that run.
        pairs: Their goal pairs.
    """

    seeds: tuple[int, ...]
    numbers: tuple[int, ...]
    scene_ids: tuple[str, ...]
    pairs: tuple[int, ...]


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class EpisodeStarts:
    """What some slots begin; one entry a slot.

    Attributes:
        tasks: Scenes and goal pairs.
        physics: How the physics differ from the scenes'; ``None``: not at all.
        noise_rngs: Where the errors of the observations come from; ``None``: they have none.
    """

    tasks: tuple[Task, ...]
    physics: tuple[PhysicsDraw, ...] | None
    noise_rngs: tuple[np.random.Generator, ...] | None


class EpisodeStreams:
    """A stream of episodes for each slot; what a slot draws depends on its seed and on nothing else.

    Args:
        source: Where the tasks come from.
        size: Slots.
        config: What physics are drawn from.
    """

    def __init__(self, source: TaskSource, size: int, config: EnvConfig) -> None:
        self.source, self._config = source, config
        self._tasks = [source.first()] * size
        self._seeds, self._numbers = [0] * size, [0] * size

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The task of each slot; before its first episode, the source's first."""
        return tuple(self._tasks)

    def seed(self, seeds: Sequence[int | None]) -> None:
        """Start the slots' streams anew; ``None``: that slot's goes on.

        Raises:
            InvalidValueError: There are not as many seeds as slots.
        """
        if len(seeds) != len(self._seeds):
            raise InvalidValueError(f"{len(seeds)} seeds for {len(self._seeds)} environments")
        for slot, seed in enumerate(seeds):
            if seed is not None:
                self._seeds[slot], self._numbers[slot] = seed, 0

    @property
    def places(self) -> StreamPlaces:
        """Where all streams are."""
        return StreamPlaces(
            seeds=tuple(self._seeds),
            numbers=tuple(self._numbers),
            scene_ids=tuple(task.scene.scene_id for task in self._tasks),
            pairs=tuple(task.pair_index for task in self._tasks),
        )

    def return_to(self, places: StreamPlaces) -> EpisodeStarts:
        """Put all streams where they were, and begin the episodes that ran there once more.

        Raises:
            InvalidValueError: The places are of another number of slots, or of streams in which nothing had begun.
            UnknownNameError: A scene is no longer there.
        """
        if min(places.numbers, default=0) < 1:
            raise InvalidValueError("these streams had begun no episode; reset the environment instead")
        self.seed(places.seeds)
        self._numbers = [number - 1 for number in places.numbers]
        return self.advance(np.arange(len(self._seeds)), list(zip(places.scene_ids, places.pairs, strict=True)))

    def advance(self, slots: Slots, chosen: Sequence[tuple[str, int]] | None = None) -> EpisodeStarts:
        """Go on to the next episode of slots.

        Args:
            slots: Which.
            chosen: Scene and pair of each; ``None``: drawn. What else an episode draws comes from the stream.

        Raises:
            UnknownNameError: There is no scene of that id, or no object of a name in ``mass_scale``.
            InvalidValueError: The scene has no such pair.
        """
        streams = [(self._seeds[slot], self._numbers[slot]) for slot in slots]
        if chosen is None:
            tasks = tuple(self.source.draw(*stream) for stream in streams)
        else:
            tasks = tuple(self.source.choose(*name) for name in chosen)
        starts = EpisodeStarts(
            tasks=tasks,
            physics=self._draw_physics(tasks, streams),
            noise_rngs=self._noise_rngs(streams),
        )
        for slot, task in zip(slots, tasks, strict=True):
            self._tasks[slot] = task
            self._numbers[slot] += 1
        return starts

    def _noise_rngs(self, streams: Sequence[tuple[int, int]]) -> tuple[np.random.Generator, ...] | None:
        if self._config.noise.is_silent:
            return None
        return tuple(generator(seed, "noise", number) for seed, number in streams)

    def _draw_physics(
        self, tasks: Sequence[Task], streams: Sequence[tuple[int, int]]
    ) -> tuple[PhysicsDraw, ...] | None:
        ranges, scales = self._config.randomisation, self._config.mass_scale
        if not (ranges.varies_model or ranges.delays_commands or scales):
            return None
        draws: list[PhysicsDraw] = []
        for task, (seed, number) in zip(tasks, streams, strict=True):
            draw = draw_physics(ranges, generator(seed, "physics", number), task.model.object_count)
            mass_scale = draw.mass_scale * named_scales(task.model.names, scales)
            draws.append(replace(draw, mass_scale=mass_scale))
        return tuple(draws)
