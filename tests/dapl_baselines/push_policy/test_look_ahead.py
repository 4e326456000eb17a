import numpy as np
import pytest

from clutter6d.cli import run
from clutter6d.eval.runner import EpisodeRunner
from clutter6d.sim.batch import SceneBatch
from dapl_baselines.checkpoint import read_checkpoint, write_checkpoint
from dapl_baselines.cli import PROGRAM
from dapl_baselines.push_policy.critic import PushCriticConfig
from dapl_baselines.push_policy.look_ahead import LookAhead
from dapl_baselines.push_policy.teacher_policy import PushTeacherPolicy
from tests.dapl_baselines.policy.networks import STATE_ONLY, make_network
from tests.dapl_baselines.push_policy.drawn import make_push
from tests.dapl_baselines.push_policy.test_critic import make_critic
from tests.scene_fixtures import make_box_scene, make_box_scene_set

CONFIG = PushCriticConfig(point_sizes=(8, 8), hidden_size=16, segments=6, whole_pushes=6, look_ahead=4)


def start_state() -> np.ndarray:
    scene, model = make_box_scene()
    batch = SceneBatch([model], threads=1)
    batch.reset(np.array([0]), scene.goal_pairs[0].object_poses[None])
    return batch.states[0].copy()


def test_pushes_are_tried_from_the_same_state_and_do_what_they_say():
    scene, model = make_box_scene()
    pushes = np.stack([make_push(1.0), make_push(-1.0)])
    tried = LookAhead(model, 2, threads=1).try_out(start_state(), pushes, scene.goal_pairs[0].goal.as_row(), 300)
    moved = tried.after.poses[:, 1] - scene.goal_pairs[0].object_poses[0, 1]
    assert moved[0] < -0.02 < 0.02 < moved[1]
    assert ((tried.steps > 10) & (tried.steps <= 60)).all()
    assert not (tried.is_success | tried.is_drop).any()


def test_what_was_tried_comes_true_to_the_bit():
    scene, _ = make_box_scene()
    policy = PushTeacherPolicy(make_critic(CONFIG), "0" * 64)
    seen: list[tuple[np.ndarray, np.ndarray]] = []
    try_out = LookAhead.try_out

    def watch(self: LookAhead, state: np.ndarray, *rest: object) -> object:
        tried = try_out(self, state, *rest)
        seen.append((state.copy(), tried.after.poses.copy()))
        return tried

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LookAhead, "try_out", watch)
        runner = EpisodeRunner(make_box_scene_set(1), policy, threads=1)
        ends = [played.env.batch.object_poses[0, 0].copy() for played in runner.rounds([(scene.scene_id, 0)])]
    assert len(seen) > 3
    for _, outcomes in seen[:3]:
        assert any(np.array_equal(end, outcome) for end in ends for outcome in outcomes)


def test_time_and_success_end_a_trial():
    scene, model = make_box_scene()
    pair, push = scene.goal_pairs[0], make_push(1.0)[None]
    ahead = LookAhead(model, 1, threads=1)
    assert ahead.try_out(start_state(), push, pair.goal.as_row(), 3).steps.tolist() == [3]
    there = ahead.try_out(start_state(), push, pair.object_poses[0], 300)
    assert (there.is_success.tolist(), there.steps.tolist()) == ([True], [1])


def test_the_command_writes_the_same_critic_with_a_look_ahead(tmp_path, capsys):
    plain = CONFIG.model_copy(update={"look_ahead": 0})
    write_checkpoint(tmp_path / "a.pt", architecture="push-critic", config=plain, module=make_critic(plain))
    arguments = ["look-ahead", "--policy", str(tmp_path / "a.pt"), "--out", str(tmp_path / "b.pt"), "--pushes", "4"]
    assert run(arguments, PROGRAM) == 0
    assert "tries 4 pushes before each decision" in capsys.readouterr().out
    before, after = read_checkpoint(tmp_path / "a.pt"), read_checkpoint(tmp_path / "b.pt")
    assert after.module.config == CONFIG
    assert after.header.weights_sha256 == before.header.weights_sha256
    assert after.header.policy_hash() != before.header.policy_hash()


def test_the_command_refuses_what_is_no_teacher(tmp_path, capsys):
    write_checkpoint(
        tmp_path / "a.pt", architecture="policy-network", config=STATE_ONLY, module=make_network(STATE_ONLY)
    )
    assert run(["look-ahead", "--policy", str(tmp_path / "a.pt"), "--out", str(tmp_path / "b.pt")], PROGRAM) == 2
    assert "holds a policy-network; give a teacher of dapl train teacher" in capsys.readouterr().err
