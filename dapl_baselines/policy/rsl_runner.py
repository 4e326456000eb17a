"""rsl_rl's runner, set up for this project: nothing printed, nothing written, one iteration at a time."""

import contextlib
import io
import os
from dataclasses import dataclass
from statistics import fmean
from typing import Any

import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner

from clutter6d.seeding import seed_words
from dapl_baselines.policy.settings import TrainingSettings

_MODULE = "dapl_baselines.policy.ppo"


@dataclass(frozen=True, kw_only=True, slots=True)
class Rank:
    """Which of several processes this is; ``torchrun`` tells by environment variables.

    Attributes:
        index: Of this process.
        device: Where it trains.
    """

    index: int
    device: str

    @classmethod
    def of_environment(cls, device: str) -> "Rank":
        """This process; on several GPUs, the one that ``torchrun`` gave it."""
        if device == "cuda":
            device = f"cuda:{int(os.environ.get('LOCAL_RANK', '0'))}"
        return cls(index=int(os.environ.get("RANK", "0")), device=device)

    @property
    def is_main(self) -> bool:
        """Whether it writes the files."""
        return self.index == 0


@dataclass(frozen=True, kw_only=True, slots=True)
class UpdateReport:
    """What rsl_rl tells of an iteration.

    Attributes:
        losses: By name: value, surrogate, entropy.
        learning_rate: Mean over the mini-batches. The adaptive schedule lets it rise while the policy is close to that
            of the rollout, and fall as it moves away: within one iteration by a factor of 10 and more.
        last_learning_rate: With which the next iteration begins.
        action_std: Mean standard deviation of the actions.
        collect_seconds: Time for the rollout.
        learn_seconds: Time for the update.
    """

    losses: dict[str, float]
    learning_rate: float
    last_learning_rate: float
    action_std: float
    collect_seconds: float
    learn_seconds: float


class UpdateLog:
    """Stands where the runner has its logger, and keeps the last iteration's report.

    Attributes:
        report: Of the last iteration.
        learning_rates: Of the mini-batches of the iteration that runs.
        writer: What the runner looks at to know whether to write models itself: it does not.
    """

    report: UpdateReport
    learning_rates: list[float]
    writer = None

    def init_logging_writer(self) -> None:
        """The runner starts to learn."""
        self.learning_rates = []

    def note_step(self, optimiser: torch.optim.Optimizer, *_: Any) -> None:
        """The optimiser made a step."""
        self.learning_rates.append(float(optimiser.param_groups[0]["lr"]))

    def process_env_step(self, *_: Any) -> None:
        """The runner made a step; the environments keep count themselves."""

    def log(
        self,
        *,
        loss_dict: dict[str, float],
        learning_rate: float,
        action_std: Any,
        collect_time: float,
        learn_time: float,
        **_: Any,
    ) -> None:
        """The runner finished an iteration."""
        self.report = UpdateReport(
            losses=dict(loss_dict),
            learning_rate=fmean(self.learning_rates),
            last_learning_rate=learning_rate,
            action_std=float(action_std.detach().mean()),
            collect_seconds=collect_time,
            learn_seconds=learn_time,
        )


class RslRunner(OnPolicyRunner):
    """The runner; its own ``save`` and ``load``, which unpickles, are not used.

    Args:
        env: Environments that have been reset.
        settings: Network and PPO.
        device: Where the networks are.
    """

    def __init__(self, env: VecEnv, settings: TrainingSettings, device: str) -> None:
        with contextlib.redirect_stdout(io.StringIO()):
            super().__init__(env, _plain_config(env, settings), log_dir=None, device=device)
        self.updates = self.logger = UpdateLog()
        self.alg.optimizer.register_step_post_hook(self.updates.note_step)

    def learn_once(self) -> UpdateReport:
        """One rollout and the update from it."""
        self.learn(1)
        return self.updates.report

    def load(self, *_: Any, **__: Any) -> Any:
        """Refused: rsl_rl would run what a file contains.

        Raises:
            NotImplementedError: Always.
        """
        raise NotImplementedError("a training is continued by dapl_baselines.policy.training")


def make_runner(env: VecEnv, settings: TrainingSettings, rank: Rank) -> RslRunner:
    """A runner with the same networks in all processes, and random numbers that are each one's own.

    rsl_rl draws from torch's global generator; from here on, its state is part of the training's.
    """
    torch.manual_seed(settings.seed)
    runner = RslRunner(env, settings, rank.device)
    torch.manual_seed(seed_words(settings.seed, "policy training", rank.index)[0])
    return runner


def _plain_config(env: VecEnv, settings: TrainingSettings) -> dict[str, Any]:
    """rsl_rl's configuration; made anew for each runner, which takes entries out of it."""
    network, entries = settings.network.model_dump(mode="json"), [*env.get_observations().keys()]
    return {
        "num_steps_per_env": settings.steps_per_env,
        "obs_groups": {"actor": list(entries), "critic": list(entries)},
        "algorithm": {"class_name": f"{_MODULE}:UnifiedPPO", **settings.ppo.model_dump()},
        "actor": {"class_name": f"{_MODULE}:PolicyActor", "network": network},
        "critic": {"class_name": f"{_MODULE}:PolicyCritic", "network": network},
    }
