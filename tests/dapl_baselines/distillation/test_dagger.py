import numpy as np
import torch

from clutter6d.eval.policy import PolicyInput
from dapl_baselines.distillation.dagger import Dagger, make_rows
from dapl_baselines.distillation.student_env import StudentView
from dapl_baselines.policy.config import STATE_SIZES
from dapl_baselines.policy.observation import CLOUD_PARTS
from dapl_baselines.policy.policy import NetworkPolicy
from tests.dapl_baselines.distillation.small_distillation import SETTINGS, make_distillation


def act_in_training(dagger: Dagger, view: StudentView) -> torch.Tensor:
    stored = dagger.student.to_stored(view.state, view.cloud)
    dagger.replay.add(make_rows(view, stored, dagger.teacher.blank(SETTINGS.envs), dagger.settings))
    count = dagger.replay.count
    return dagger.student.act(dagger._windows(np.arange(count - SETTINGS.envs, count)))


def act_in_evaluation(policy: NetworkPolicy, view: StudentView) -> np.ndarray:
    parts = SETTINGS.network.state_parts
    states = view.state.split([STATE_SIZES[part] for part in parts], dim=1)
    points = view.cloud.split([512, 512, 256], dim=1)
    seen = dict(zip((*parts, *CLOUD_PARTS), (*states, *points), strict=True))
    ages = view.ages.numpy()
    policy.begin(np.flatnonzero(ages == 0), ())
    observation = {name: tensor.numpy() for name, tensor in seen.items()}
    slots = np.arange(len(ages))
    return policy.act(PolicyInput(slots=slots, episodes=(), steps=ages, observation=observation, states=None))


def test_what_the_student_does_in_training_is_what_its_checkpoint_does(tmp_path):
    """It remembers rows of the replay here and frames there; over the end of an episode, and round the ring."""
    settings = SETTINGS.model_copy(update={"encoder_precision": "float32", "replay_rows": 16})
    dagger = make_distillation(tmp_path / "run", settings)._dagger
    policy, steps = NetworkPolicy(dagger.student.network, "0" * 64), 2 * SETTINGS.max_steps + 2
    actions = []
    for _ in range(steps):
        view = dagger.env.student_view()
        own = act_in_training(dagger, view)
        np.testing.assert_allclose(act_in_evaluation(policy, view), own, atol=2e-4)
        dagger.env.step(own)
        actions.append(own)
    assert torch.stack(actions).std(dim=0).max() > 2e-3
