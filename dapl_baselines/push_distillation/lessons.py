"""What a student of pushes learns from: a state as it saw it, pushes, and what the teacher thinks of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.choice import look_at_pushes
from dapl_baselines.push_policy.critic import Judgement, PushCritic
from dapl_baselines.push_policy.push_frame import PushView, view_pushes
from dapl_baselines.push_policy.push_state import STATE_FIELDS, PushState, to_tensor
from dapl_baselines.push_policy.seen import Seen


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Lessons:
    """States, one row each.

    Attributes:
        state: Where things are, as the student sees it.
        goals: Where the targets shall go.
        surface: Surface points of the targets, from their centroids [m].
        pushes: The pushes, from the same centroids.
        tokens: What the encoder makes of the clouds.
        gain: What each push brings, as the teacher thinks.
        future: What comes after it.
    """

    state: PushState[Tensor]
    goals: Float[Tensor, "row 7"]
    surface: Float[Tensor, "row 48 3"]
    pushes: Float[Tensor, "row push column"]
    tokens: Float[Tensor, "row token size"]
    gain: Float[Tensor, "row push"]
    future: Float[Tensor, "row push"]

    @classmethod
    def of(
        cls, seen: Seen, pushes: Float[np.ndarray, "row push column"], tokens: Tensor, judged: Judgement
    ) -> "Lessons":
        """What is seen of slots, pushes drawn for it, tokens of its clouds, and the teacher's judgement."""
        return cls(
            state=seen.state.to_tensors(),
            goals=to_tensor(seen.goals),
            surface=to_tensor(seen.shapes.surface[seen.targets]),
            pushes=to_tensor(pushes),
            tokens=tokens,
            gain=judged.gain,
            future=judged.future,
        )

    def view(self) -> PushView:
        """What the student sees of the pushes."""
        return view_pushes(self.state, self.goals, self.surface, self.pushes)

    def to_rows(self) -> dict[str, Tensor]:
        """As the replay keeps them; tokens in half precision."""
        state = {f"state_{name}": getattr(self.state, name) for name in STATE_FIELDS if name != "obstacles"}
        others = {name: getattr(self, name) for name in ("goals", "surface", "pushes", "gain", "future")}
        return state | others | {"tokens": self.tokens.half()}

    @classmethod
    def of_rows(cls, rows: Mapping[str, Tensor]) -> "Lessons":
        """From rows of the replay."""
        state = {name: rows[f"state_{name}"] for name in STATE_FIELDS if name != "obstacles"}
        nobody = rows["goals"].new_zeros(len(rows["goals"]), 0, 5)
        others = {name: rows[name] for name in ("goals", "surface", "pushes", "gain", "future")}
        return cls(state=PushState(obstacles=nobody, **state), tokens=rows["tokens"].float(), **others)


def ask_teacher(
    teacher: PushCritic, known: Seen, seen: Seen, pushes: Float[np.ndarray, "row push column"]
) -> Judgement:
    """What a privileged critic thinks of pushes that were drawn for what a student sees.

    Args:
        teacher: The critic.
        known: The same slots, as the simulation knows them.
        seen: As the student sees them.
        pushes: From the centroids that the student sees.
    """
    shift = (seen.state.poses[:, :3] - known.state.poses[:, :3])[:, None]
    moved = pushes.copy()
    for part in (columns.CONTACT, columns.START):
        moved[..., part] += shift
    with torch.no_grad():
        return teacher(look_at_pushes(known.state, known.goals, known.shapes.surface[known.targets], moved))
