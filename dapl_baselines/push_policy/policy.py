"""A critic of pushes as a policy of the evaluation: it chooses a push, carries it out, and chooses anew."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float32, Float64, Int

from clutter6d.envs.action import ActionConfig
from clutter6d.envs.observation import BodyState
from clutter6d.envs.termination import MAX_CONTROL_STEPS
from clutter6d.errors import InvalidValueError
from clutter6d.eval.policy import Episode, PolicyInput
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_kinematics
from clutter6d.sim.scene_model import ARM_DOF, motion_in_states
from dapl_baselines.push_policy.candidates import Counts, draw_candidates
from dapl_baselines.push_policy.choice import judge
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.look_ahead import LookAhead, Tried
from dapl_baselines.push_policy.outcomes import future, gains
from dapl_baselines.push_policy.push_state import PushState, SceneFacts, read_push_state
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.tracker import PushTracker


class PushPolicy:
    """The push that the critic likes best, of some that are drawn by episode and step.

    With a look ahead, the best of these are tried in copies of the simulation, and the one is chosen that ends best: by
    what it brought, and by what the critic expects from there on.

    Args:
        critic: The trained network.
        policy_hash: Hash of architecture, configuration and weights.
    """

    is_privileged = True
    needs_observation = False

    def __init__(self, critic: PushCritic, policy_hash: str) -> None:
        self.policy_hash = policy_hash
        self._critic, config = critic.eval(), critic.config
        self._counts = Counts(segments=config.segments, whole=config.whole_pushes)
        self._slots: dict[int, _Slot] = {}
        self._look_ahead: tuple[str, LookAhead] | None = None

    @property
    def name(self) -> str:
        """Says whether it looks ahead."""
        return "push-teacher-look-ahead" if self._critic.config.look_ahead else "push-teacher"

    def begin(self, slots: Int[np.ndarray, "slot"], episodes: Sequence[Episode]) -> None:
        """Forget the pushes of slots in which episodes start.

        Raises:
            InvalidValueError: A scene has another number of objects than the critic knows.
        """
        known = self._critic.config.obstacles + 1
        for slot, episode in zip(slots.tolist(), episodes, strict=True):
            found = episode.scene_model.object_count
            if found != known:
                raise InvalidValueError(
                    f"the teacher knows scenes of {known} objects, these have {found}; choose others"
                )
            self._slots[slot] = _Slot(episode)

    def act(self, inputs: PolicyInput) -> Float32[np.ndarray, "slot 7"]:
        """Joint residuals [rad].

        Raises:
            InvalidValueError: The input lacks the simulation's states.
        """
        if inputs.states is None:
            raise InvalidValueError("the teacher is privileged: it needs the simulation's states in its input")
        rows = zip(inputs.slots.tolist(), inputs.steps.tolist(), inputs.states, strict=True)
        return np.concatenate([self._act(self._slots[slot], step, state) for slot, step, state in rows])

    def _act(self, slot: "_Slot", step: int, state: Float64[np.ndarray, "state"]) -> Float32[np.ndarray, "1 7"]:
        """One slot by itself: products of matrices of other sizes would differ in their last bits."""
        bodies = _bodies(state, slot.facts.radii.shape[1])
        hand = hand_kinematics(bodies.arm_qpos)
        seen = read_push_state(bodies, hand, slot.facts)
        if slot.tracker.is_over()[0]:
            push = self._choose(slot, step, seen, state)
            slot.tracker.begin(np.zeros(1, dtype=np.int64), push, seen.poses[:, :3])
        around = slot.shapes.placed_contacts(slot.target, seen.poses)
        residuals = slot.tracker.residuals(hand, bodies.arm_qvel, around, ActionConfig())
        return residuals.astype(np.float32)

    def _choose(
        self, slot: "_Slot", step: int, seen: PushState[np.ndarray], state: Float64[np.ndarray, "state"]
    ) -> Float64[np.ndarray, "1 column"]:
        episode = slot.episode
        rng = generator(episode.seed, "pushes", episode.scene.scene_id, episode.pair_index, step)
        drawn = draw_candidates(seen, slot.goal, slot.shapes, slot.target, self._counts, rng)
        values = judge(self._critic, seen, slot.goal, slot.shapes.surface[slot.target], drawn)
        count = min(self._critic.config.look_ahead, drawn.shape[1])
        if not count:
            return drawn[:, int(values[0].argmax())]
        best = np.argsort(-values[0], kind="stable")[:count]
        tried = self._copies(episode, count).try_out(state, drawn[0, best], slot.goal[0], MAX_CONTROL_STEPS - step)
        return drawn[:, best[int(self._worth(slot, seen, tried, rng).argmax())]]

    def _worth(
        self, slot: "_Slot", before: PushState[np.ndarray], tried: Tried, rng: np.random.Generator
    ) -> Float64[np.ndarray, "push"]:
        """What pushes brought, and what the critic expects after them."""
        prices, count = self._critic.config.prices, len(tried.steps)
        goals, targets = np.repeat(slot.goal, count, axis=0), np.repeat(slot.target, count)
        drawn = draw_candidates(tried.after, goals, slot.shapes, targets, self._counts, rng)
        value = judge(self._critic, tried.after, goals, slot.shapes.surface[targets], drawn).max(axis=1)
        poses = np.repeat(before.poses, count, axis=0), tried.after.poses
        ends = {"is_success": tried.is_success, "is_drop": tried.is_drop}
        brought = gains(*poses, goals, steps=tried.steps, prices=prices, **ends)
        is_over = tried.is_success | tried.is_drop
        return brought + future(value, steps=tried.steps, is_over=is_over, prices=prices)

    def _copies(self, episode: Episode, count: int) -> LookAhead:
        """Copies of an episode's scene; those of the last one are kept."""
        if self._look_ahead is None or self._look_ahead[0] != episode.scene.scene_id:
            self._look_ahead = episode.scene.scene_id, LookAhead(episode.scene_model, count)
        return self._look_ahead[1]


class _Slot:
    """What is remembered of an episode."""

    def __init__(self, episode: Episode) -> None:
        scene = episode.scene_model
        self.episode, self.goal = episode, episode.pair.goal.as_row()[None]
        self.facts, self.shapes = SceneFacts.of([scene]), TargetShapes.of(scene.assets[:1])
        self.target = np.zeros(1, dtype=np.int64)
        self.tracker = PushTracker(size=1)


def _bodies(state: Float64[np.ndarray, "state"], objects: int) -> BodyState[np.ndarray]:
    qpos, qvel = motion_in_states(state[None], objects)
    return BodyState(
        arm_qpos=qpos[:, :ARM_DOF],
        arm_qvel=qvel[:, :ARM_DOF],
        object_poses=qpos[:, ARM_DOF:].reshape(1, objects, 7),
        object_velocities=qvel[:, ARM_DOF:].reshape(1, objects, 6),
    )
