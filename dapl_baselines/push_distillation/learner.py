"""How a student of pushes learns what its teacher thinks of them."""

import copy
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from dapl_baselines.policy.encoder_source import EncoderSource
from dapl_baselines.push_distillation.lessons import Lessons
from dapl_baselines.push_distillation.settings import PushDistillationSettings
from dapl_baselines.push_policy.student import PushStudent
from dapl_baselines.push_policy.training_settings import descend
from dapl_baselines.replay import Replay


@dataclass(frozen=True, kw_only=True, slots=True)
class StudentLosses:
    """Means over steps of the optimiser.

    Attributes:
        gain: Of what pushes bring.
        future: Of what comes after.
        rank: Divergence of the choices that the values make likely from the teacher's.
        agreement: Share of states in which the student likes best what the teacher does.
        regret: By how much the student's choice is worse than the teacher's, as the teacher thinks.
    """

    gain: float
    future: float
    rank: float
    agreement: float
    regret: float


class StudentLearner:
    """A student and its optimiser; the encoder is frozen.

    Args:
        settings: Of the distillation.
        source: The encoder.

    Attributes:
        student: The student.
        optimizer: AdamW.
        updates: Steps made.
    """

    def __init__(self, settings: PushDistillationSettings, source: EncoderSource) -> None:
        self._settings = settings
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(settings.seed)
            self.student = PushStudent(settings.student)
        self.student.encoder.load_state_dict(source.module.state_dict())
        self.student.eval()
        learned = [parameter for parameter in self.student.parameters() if parameter.requires_grad]
        self.optimizer = torch.optim.AdamW(learned, lr=settings.learning_rate, weight_decay=settings.weight_decay)
        self.updates = 0

    def learn(self, replay: Replay, end: int, rng: np.random.Generator) -> StudentLosses:
        """The updates of one iteration; returns their mean losses.

        Args:
            replay: What is learned from.
            end: Lessons from this number on are not looked at: they are being added meanwhile.
            rng: Where they are drawn from.
        """
        # What is added until the next state is on disk takes the place of the oldest, and is there after a kill.
        oldest = replay.oldest_of(end + self._settings.rows_at_risk)
        shape = self._settings.updates, self._settings.batch
        batches = (Lessons.of_rows(replay.take(rows, replay.fields)) for rows in rng.integers(oldest, end, size=shape))
        gain, future, rank, agreement, regret = (
            torch.stack([self._update(each) for each in batches]).mean(dim=0).tolist()
        )
        return StudentLosses(gain=gain, future=future, rank=rank, agreement=agreement, regret=regret)

    def acting_copy(self) -> PushStudent:
        """A copy that does not learn."""
        return copy.deepcopy(self.student).requires_grad_(False)

    def _update(self, lessons: Lessons) -> Float[Tensor, "5"]:
        settings, judged = self._settings, self.student(lessons.view(), lessons.tokens)
        gain = nn.functional.smooth_l1_loss(judged.gain, lessons.gain, beta=settings.huber)
        future = nn.functional.smooth_l1_loss(judged.future, lessons.future, beta=settings.huber)
        truth = lessons.gain + lessons.future
        rank = nn.functional.kl_div(
            torch.log_softmax(judged.value / settings.temperature, dim=1),
            torch.log_softmax(truth / settings.temperature, dim=1),
            log_target=True,
            reduction="batchmean",
        )
        descend(self.optimizer, gain + future + settings.rank_weight * rank, settings, self.updates)
        self.updates += 1
        chosen, best = judged.value.argmax(dim=1), truth.max(dim=1)
        regret = (best.values - truth.gather(1, chosen[:, None])[:, 0]).mean()
        return torch.stack([gain, future, rank, (chosen == best.indices).float().mean(), regret]).detach()
