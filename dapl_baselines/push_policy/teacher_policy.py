"""A privileged critic of pushes as a policy of the evaluation."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float64, Int

from clutter6d.envs.observation import BodyState
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.sim.scene_model import ARM_DOF, motion_in_states
from dapl_baselines.push_policy.candidates import draw_candidates
from dapl_baselines.push_policy.choice import choose, judge
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.look_ahead import LookAhead, Tried
from dapl_baselines.push_policy.outcomes import future, gains
from dapl_baselines.push_policy.policy import FIRST, PushingPolicy
from dapl_baselines.push_policy.push_state import SceneFacts
from dapl_baselines.push_policy.seen import Seen, see_states
from dapl_baselines.push_policy.target_shapes import TargetShapes


class PushTeacherPolicy(PushingPolicy):
    """The push that a privileged critic likes best.

    With a look ahead, the best of these are tried in copies of the simulation, and the one is chosen that ends best: by
    what it brought, and by what the critic expects from there on.

    Args:
        critic: The trained network.
        policy_hash: Hash of architecture, configuration and weights.
    """

    is_privileged = True
    needs_observation = False

    def __init__(self, critic: PushCritic, policy_hash: str) -> None:
        super().__init__(critic.config, policy_hash)
        self._critic, self._config = critic.eval(), critic.config
        self._known: dict[int, tuple[SceneFacts, TargetShapes]] = {}
        self._copies: tuple[str, LookAhead] | None = None

    @property
    def name(self) -> str:
        """Says whether it looks ahead."""
        return "push-teacher-look-ahead" if self._config.look_ahead else "push-teacher"

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Forget the pushes of slots in which episodes start.

        Raises:
            InvalidValueError: A scene has another number of objects than the critic knows.
        """
        super().begin(slots, episodes)
        known = self._config.obstacles + 1
        for slot, episode in zip(slots.tolist(), episodes, strict=True):
            scene = episode.scene_model
            if scene.object_count != known:
                raise InvalidValueError(f"the teacher knows scenes of {known} objects, not of {scene.object_count}")
            self._known[slot] = SceneFacts.of([scene]), TargetShapes.of(scene.assets[:1])

    def _see(self, inputs: PolicyInput, row: int) -> Seen:
        if inputs.states is None:
            raise InvalidValueError("the teacher is privileged: it needs the simulation's states in its input")
        facts, shapes = self._known[int(inputs.slots[row])]
        bodies = read_bodies(inputs.states[row : row + 1], self._config.obstacles + 1)
        return see_states(bodies, inputs.episodes[row].pair.goal.as_row()[None], facts, shapes, FIRST)

    def _choose(
        self, inputs: PolicyInput, row: int, make_rng: Callable[[], np.random.Generator]
    ) -> Float64[np.ndarray, "1 column"]:
        seen = self._see(inputs, row)
        drawn = self._draw(seen, make_rng())
        values = judge(self._critic, seen.state, seen.goals, seen.shapes.surface[seen.targets], drawn)
        may_begin, count = self._may_begin(int(inputs.slots[row]), seen), min(self._config.look_ahead, values.shape[1])
        if not count or inputs.states is None:
            return drawn[:, choose(values, drawn, may_begin)[0]]
        # A push that cannot begin is tried only where fewer can than are to be tried.
        best = np.lexsort((-values[0], ~may_begin(drawn[0])))[:count]
        copies, steps_left = self._copies_of(inputs.episodes[row], count), MAX_CONTROL_STEPS - int(inputs.steps[row])
        tried = copies.try_out(inputs.states[row], drawn[0, best], seen.goals[0], steps_left)
        return drawn[:, best[int(self._worth(seen, tried, make_rng()).argmax())]]

    def _worth(self, seen: Seen, tried: Tried, rng: np.random.Generator) -> Float64[np.ndarray, "push"]:
        """What pushes brought, and what the critic expects after them."""
        prices, rows = self._config.prices, np.zeros(len(tried.steps), dtype=np.int64)
        goals, targets = seen.goals[rows], seen.targets[rows]
        drawn = draw_candidates(tried.after, goals, seen.shapes, targets, self._counts, rng)
        value = judge(self._critic, tried.after, goals, seen.shapes.surface[targets], drawn).max(axis=1)
        ends = {"steps": tried.steps, "is_success": tried.is_success, "is_drop": tried.is_drop}
        brought = gains(seen.state.poses[rows], tried.after.poses, goals, prices=prices, **ends)
        return brought + future(value, steps=tried.steps, is_over=tried.is_success | tried.is_drop, prices=prices)

    def _copies_of(self, episode: Episode, count: int) -> LookAhead:
        """Copies of an episode's scene; those of the last one are kept."""
        if self._copies is None or self._copies[0] != episode.scene.scene_id:
            self._copies = episode.scene.scene_id, LookAhead(episode.scene_model, count)
        return self._copies[1]


def read_bodies(states: Float64[np.ndarray, "slot state"], objects: int) -> BodyState[np.ndarray]:
    """Where everything is in full integration states."""
    qpos, qvel = motion_in_states(states, objects)
    return BodyState(
        arm_qpos=qpos[:, :ARM_DOF],
        arm_qvel=qvel[:, :ARM_DOF],
        object_poses=qpos[:, ARM_DOF:].reshape(-1, objects, 7),
        object_velocities=qvel[:, ARM_DOF:].reshape(-1, objects, 6),
    )
