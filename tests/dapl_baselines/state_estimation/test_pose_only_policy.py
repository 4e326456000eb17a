from dataclasses import dataclass, field

import numpy as np
import pytest

from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.termination import TerminationConfig
from clutter6d.errors import InvalidValueError
from clutter6d.eval.builtin_policies import ZeroPolicy
from clutter6d.eval.policy import identity_hash
from clutter6d.eval.runner import EpisodeRunner
from dapl_baselines.state_estimation.pose_only_policy import EstimatorConfig, PoseOnlyPolicy
from tests.scene_fixtures import make_box_scene_set

KEYS = [("boxes-0", 0), ("boxes-0", 1), ("boxes-1", 0)]


@dataclass(kw_only=True)
class Follower:
    """Acts on the points that it sees, and remembers what it was shown."""

    name: str = "follower"
    policy_hash: str = identity_hash("follower")
    is_privileged: bool = False
    needs_observation: bool = True
    shown: list = field(default_factory=list)

    def begin(self, slots, episodes):
        pass

    def act(self, inputs):
        assert inputs.states is None
        self.shown.append(inputs.observation)
        return (0.1 * inputs.observation["object_points"][:, :7].mean(axis=2)).astype(np.float32)


def actions_of(policy, num_envs):
    config = EnvConfig(termination=TerminationConfig(max_steps=6))
    runner = EpisodeRunner(make_box_scene_set(), policy, config=config, num_envs=num_envs, threads=1)
    return {record.row.key: record.actions for record in runner.run(KEYS)}


def test_actions_do_not_depend_on_what_runs_at_once():
    config = EstimatorConfig(missed_share=0.2)
    alone, together = (actions_of(PoseOnlyPolicy(Follower(), config), envs) for envs in (1, 3))
    assert set(alone) == set(KEYS)
    for key in KEYS:
        assert np.array_equal(alone[key], together[key])


def test_the_policy_sees_noisy_poses_and_noisy_goals():
    exact, noisy = Follower(), Follower()
    actions_of(exact, 1)
    actions_of(PoseOnlyPolicy(noisy, EstimatorConfig(position_sigma_m=0.002)), 1)
    errors = [a["object_points"] - b["object_points"] for a, b in zip(noisy.shown[:6], exact.shown[:6], strict=True)]
    assert 1e-4 < np.abs(np.stack(errors)[..., :3]).mean() < 0.01
    velocities = np.abs(noisy.shown[1]["object_points"][..., 4:])
    assert 0 < velocities.max() < 0.3
    assert np.array_equal(noisy.shown[3]["joint_state"].shape, exact.shown[3]["joint_state"].shape)


def test_policy_and_estimator_are_part_of_the_hash():
    first, again, other = (
        PoseOnlyPolicy(Follower(), config) for config in (None, EstimatorConfig(), EstimatorConfig(missed_share=0.1))
    )
    assert first.policy_hash == again.policy_hash != other.policy_hash
    assert first.name == "follower-from-poses"
    assert first.is_privileged


@pytest.mark.parametrize("policy", [ZeroPolicy(), Follower(is_privileged=True)])
def test_only_policies_that_act_on_observations_can_be_wrapped(policy):
    with pytest.raises(InvalidValueError, match="does not act on observations alone"):
        PoseOnlyPolicy(policy)
