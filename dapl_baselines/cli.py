"""The command ``dapl``: record interactions, train, distil, serve. Errors and exit codes are those of ``clutter6d``."""

import sys
from importlib.metadata import EntryPoint
from typing import Final

from clutter6d.cli import Program, run

_COMMANDS: Final = {
    "record": ("dapl_baselines.interactions.cli:record", "Record interactions of any policy, to train on."),
    "train world-model": ("dapl_baselines.world_model.cli:train_world_model", "Train a world model, or an ablation."),
    "show-predictions": ("dapl_baselines.world_model.cli:show_predictions", "Draw predicted beside true motion."),
    "train corn": ("dapl_baselines.contact_pretraining.cli:train_corn", "Pretrain CORN's encoder on contacts."),
    "train teacher": ("dapl_baselines.teacher.cli:train_teacher", "Train a teacher that chooses among pushes."),
    "look-ahead": ("dapl_baselines.push_policy.cli:look_ahead", "Let a teacher try pushes in simulation first."),
    "train policy": ("dapl_baselines.policy.cli:train_policy", "Train a policy by PPO on a frozen encoder."),
    "curriculum": ("dapl_baselines.curriculum.cli:curriculum", "Train world model and policy in turn, unattended."),
    "distill": ("dapl_baselines.distillation.cli:distill", "Distil a teacher into a policy that sees points alone."),
    "distill-pushes": (
        "dapl_baselines.push_distillation.cli:distill_pushes",
        "Distil a teacher of pushes into one that sees points alone.",
    ),
    "validate": ("dapl_baselines.validation_cli:validate", "Evaluate a policy on the scenes that trainings hold out."),
    "show-curves": ("dapl_baselines.curves_cli:show_curves", "Draw learning curves of trainings of policies."),
    "serve": ("dapl_baselines.serving.cli:serve", "Serve a policy to a robot's computer, over a websocket."),
    "export": ("dapl_baselines.serving.cli:export", "Export a policy to ONNX and TorchScript."),
}
"""Where each command is found, and what the help says of it; in the order of a user's work."""

PROGRAM = Program(
    name="dapl",
    summary="Dynamics-aware policy learning: world model, policy, distillation.",
    summaries={name: summary for name, (_, summary) in _COMMANDS.items()},
    find_commands=lambda: tuple(EntryPoint(name, value, "dapl.commands") for name, (value, _) in _COMMANDS.items()),
    group_summaries={"train": "Train a world model or a policy; every training goes on where it was stopped."},
)


def main() -> None:
    """Entry point of the console script."""
    sys.exit(run(sys.argv[1:], PROGRAM))
