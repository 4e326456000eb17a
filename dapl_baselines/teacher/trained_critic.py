"""The critic of a trained teacher: to be learned from, or to be trained on."""

from clutter6d.errors import InvalidValueError
from dapl_baselines.checkpoint import Checkpoint
from dapl_baselines.push_policy.critic import PushCritic, PushCriticConfig


def critic_of(teacher: Checkpoint, *, objects: int) -> PushCritic:
    """The critic in a checkpoint, frozen.

    Args:
        teacher: The checkpoint.
        objects: Of the scenes that it is wanted for.

    Raises:
        InvalidValueError: It is no critic of pushes, or one of scenes with another number of objects.
    """
    critic = teacher.module
    if not isinstance(critic, PushCritic):
        raise InvalidValueError(f"the teacher is a {teacher.header.architecture}; give one of dapl train teacher")
    known = critic.config.obstacles + 1
    if known != objects:
        raise InvalidValueError(f"the teacher knows scenes of {known} objects, not of {objects}; choose others")
    return critic.eval().requires_grad_(False)


def critic_to_begin_with(teacher: Checkpoint, config: PushCriticConfig) -> PushCritic:
    """The critic in a checkpoint, for a training of critics like it.

    Args:
        teacher: The checkpoint.
        config: Of the training's critic.

    Raises:
        InvalidValueError: It is no critic of pushes, or has other sizes, or judges by other prices.
    """
    critic = critic_of(teacher, objects=config.obstacles + 1)
    for name in ("point_sizes", "hidden_size", "prices"):
        wanted, found = getattr(config, name), getattr(critic.config, name)
        if wanted != found:
            raise InvalidValueError(f"{name} is {wanted}, and {found} in the teacher to begin with; choose alike")
    return critic
