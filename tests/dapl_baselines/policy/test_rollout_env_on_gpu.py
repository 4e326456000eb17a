"""The same environment on the GPU's back end, on Warp's CPU device; its kernels are compiled first: slow."""

import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.envs.warp_env import WarpVectorEnv
from clutter6d.sim.warp_runtime import torch
from dapl_baselines.encoders.dapl import DaplEncoder
from dapl_baselines.policy.frozen_encoder import FrozenEncoder
from dapl_baselines.policy.ppo import STATE_KEY, TOKENS_KEY
from dapl_baselines.policy.rollout_env import RolloutEnv
from tests.dapl_baselines.policy.networks import SMALL_ENCODER, WITH_POINTS
from tests.scene_fixtures import make_box_scene_set
from tests.warp_fixtures import DEVICES, compile_quickly, skip_without

OPTIONS = {
    "split": make_box_scene_set(3),
    "config": EnvConfig(termination=TerminationConfig(max_steps=2)),
    "autoreset_mode": "SameStep",
}


@pytest.mark.slow
@pytest.mark.parametrize("device", DEVICES)
def test_it_shows_and_rewards_what_the_cpus_does(device):
    compile_quickly()
    envs = [ClutterVectorEnv(2, **OPTIONS), WarpVectorEnv(2, device=skip_without(device), **OPTIONS)]
    module = DaplEncoder(SMALL_ENCODER)
    ours, theirs = (
        RolloutEnv(made, WITH_POINTS, FrozenEncoder(module, where, torch.float32), reward_scale=0.1)
        for made, where in zip(envs, ("cpu", device), strict=True)
    )
    assert (ours.can_be_restored, theirs.can_be_restored) == (True, False)
    for env in (ours, theirs):
        env.reset(seed=3)
    for step in range(3):
        actions = torch.full((2, 7), 0.3)
        one, other = ours.step(actions), theirs.step(actions.to(device))
        assert other[0][STATE_KEY].device.type == torch.device(device).type
        torch.testing.assert_close(one[0][STATE_KEY], other[0][STATE_KEY].cpu(), atol=1e-2, rtol=0)
        torch.testing.assert_close(one[0][TOKENS_KEY], other[0][TOKENS_KEY].cpu(), atol=0.1, rtol=0)
        torch.testing.assert_close(one[1], other[1].cpu(), atol=1e-2, rtol=0)
        assert one[2].tolist() == other[2].tolist() == one[3]["time_outs"].tolist() == [step % 2 == 1] * 2
    assert ours.tally.take().episodes == theirs.tally.take().episodes == 2
