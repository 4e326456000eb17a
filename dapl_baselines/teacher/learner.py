"""How a teacher's critic learns from what pushes did: fitted Q iteration with a slow copy of itself."""

import copy
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor, nn

from clutter6d.geometry import quat_conjugate, quat_multiply
from dapl_baselines.push_policy.candidates import draw_candidates
from dapl_baselines.push_policy.choice import judge, look_at_pushes
from dapl_baselines.push_policy.critic import PushCritic
from dapl_baselines.push_policy.outcomes import Prices, future, gains
from dapl_baselines.push_policy.push_frame import push_axes
from dapl_baselines.push_policy.push_state import to_tensor
from dapl_baselines.push_policy.target_shapes import TargetShapes
from dapl_baselines.push_policy.training_settings import descend
from dapl_baselines.replay import Replay
from dapl_baselines.teacher.settings import TeacherSettings
from dapl_baselines.teacher.transitions import MIRROR, Transitions, mirrored, mirrored_pushes, take_transitions

MOTION_SCALE_PER_M = 8.0
"""Displacements are counted in eighths of a metre, rotations in radians: both of the size of what a push does."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Losses:
    """Of a step of the optimiser; means over transitions that count.

    Attributes:
        gain: Of what a push brings.
        future: Of what comes after.
        motion: Of the target's motion.
        unexplained: Share of the variance of what pushes bring that is not predicted.
        value: Mean value of where pushes end.
    """

    gain: float
    future: float
    motion: float
    unexplained: float
    value: float


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Lesson:
    """What one step of the optimiser learns from.

    Attributes:
        found: Transitions.
        surface: Surface points of their targets [m].
        future: Value of where each push ended, discounted; 0 where the episode did.
    """

    found: Transitions
    surface: Float32[np.ndarray, "row point 3"]
    future: Float32[np.ndarray, "row"]


class TeacherLearner:
    """A critic, its slow copy, and their optimiser.

    Args:
        settings: Of the training.
        shapes: Shapes of all targets.

    Attributes:
        critic: The critic.
        slow: Its slow copy, which values where pushes end.
        optimizer: AdamW.
        updates: Steps made.
    """

    def __init__(self, settings: TeacherSettings, shapes: TargetShapes) -> None:
        self._settings, self._shapes = settings, shapes
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(settings.seed)
            self.critic = PushCritic(settings.critic)
        self.slow = copy.deepcopy(self.critic).requires_grad_(False)
        self.optimizer = torch.optim.AdamW(
            self.critic.parameters(), lr=settings.learning_rate, weight_decay=settings.weight_decay
        )
        self.updates = 0

    def begin_with(self, critic: PushCritic) -> None:
        """Take over the weights of a trained critic of the same sizes."""
        for network in (self.critic, self.slow):
            network.load_state_dict(critic.state_dict())

    def learn(self, replay: Replay, end: int, rng: np.random.Generator) -> Losses:
        """The updates of one iteration; returns their mean losses.

        Args:
            replay: What is learned from.
            end: Transitions from this number on are not looked at: they are being added meanwhile.
            rng: Where all is drawn from.
        """
        # What is added until the next state is on disk takes the place of the oldest, and is there after a kill.
        oldest = replay.oldest_of(end + self._settings.rows_at_risk)
        losses = [self._update(self._draw(replay, oldest, end, rng)) for _ in range(self._settings.updates)]
        means = torch.tensor([list(each) for each in losses], dtype=torch.float64).mean(dim=0).tolist()
        return Losses(gain=means[0], future=means[1], motion=means[2], unexplained=means[3], value=means[4])

    def _draw(self, replay: Replay, oldest: int, end: int, rng: np.random.Generator) -> Lesson:
        numbers = rng.integers(oldest, end, size=self._settings.batch)
        found = take_transitions(replay, numbers, end, self._settings.goals, rng)
        surface = self._shapes.surface[found.targets]
        drawn = draw_candidates(
            found.after, found.goals, self._shapes, found.targets, self._settings.future_counts, rng
        )
        if rng.random() < 0.5:
            found, surface, drawn = mirrored(found), surface * MIRROR, mirrored_pushes(drawn)
        value = judge(self.slow, found.after, found.goals, surface, drawn).max(axis=1)
        is_over, prices = found.is_success | found.is_drop, self._settings.critic.prices
        later = future(value, steps=found.steps, is_over=is_over, prices=prices)
        return Lesson(found=found, surface=surface, future=later.astype(np.float32))

    def _update(self, lesson: Lesson) -> tuple[float, ...]:
        settings, found = self._settings, lesson.found
        gain, later = torch.from_numpy(gains_of(found, settings.critic.prices)), torch.from_numpy(lesson.future)
        judged = self.critic(look_at_pushes(found.before, found.goals, lesson.surface, found.pushes[:, None]))
        weights = torch.from_numpy(found.weights) / max(float(found.weights.sum()), 1.0)

        def loss_of(guess: Tensor, truth: Tensor) -> Tensor:
            return nn.functional.smooth_l1_loss(guess, truth, beta=settings.huber, reduction="none")

        parts = torch.stack(
            [
                (loss_of(judged.gain[:, 0], gain) * weights).sum(),
                (loss_of(judged.future[:, 0], later) * weights).sum(),
                (loss_of(judged.motion[:, 0], motions(found)).mean(dim=-1) * weights).sum(),
            ]
        )
        total = parts[0] + settings.future_weight * parts[1] + settings.motion_weight * parts[2]
        self._step(total)
        unexplained = (judged.gain[:, 0].detach() - gain).var() / gain.var().clamp(min=1e-9)
        return (*parts.tolist(), float(unexplained), float(later.mean()))

    def _step(self, loss: Tensor) -> None:
        """One step of the optimiser, and of the slow copy after it."""
        descend(self.optimizer, loss, self._settings, self.updates)
        with torch.no_grad():
            for slow, fast in zip(self.slow.parameters(), self.critic.parameters(), strict=True):
                slow.lerp_(fast, self._settings.target_rate)
        self.updates += 1


def gains_of(found: Transitions, prices: Prices) -> Float32[np.ndarray, "row"]:
    """What each push brought."""
    ends = {"steps": found.steps, "is_success": found.is_success, "is_drop": found.is_drop}
    return gains(found.before.poses, found.after.poses, found.goals, prices=prices, **ends).astype(np.float32)


def motions(found: Transitions) -> Float32[Tensor, "row 6"]:
    """How the targets moved, in the frames of the pushes; as :class:`~dapl_baselines.push_policy.critic.Judgement`."""
    before, after, pushes = (to_tensor(each) for each in (found.before.poses, found.after.poses, found.pushes))
    turn = quat_multiply(after[:, 3:], quat_conjugate(before[:, 3:]))
    turn = torch.where(turn[:, :1] < 0, -turn, turn)
    sine = torch.linalg.vector_norm(turn[:, 1:], dim=-1, keepdim=True)
    rotation = 2 * torch.atan2(sine, turn[:, :1]) * turn[:, 1:] / sine.clamp(min=1e-6)
    vectors = torch.stack([MOTION_SCALE_PER_M * (after[:, :3] - before[:, :3]), rotation], dim=1)
    return (vectors @ push_axes(pushes).mT).flatten(1)
