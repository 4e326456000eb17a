"""The environment on a GPU's back end, on Warp's CPU device, against the CPU's; what steps compiles first: slow."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode

from clutter6d.envs.cameras import DEFAULT_CAMERAS
from clutter6d.envs.env_config import EnvConfig
from clutter6d.envs.noise import DISTILLATION_NOISE
from clutter6d.envs.randomisation import MODEST_RANDOMISATION
from clutter6d.envs.slots import ClutterSlots
from clutter6d.envs.termination import OUTCOMES, find_outcome, is_at_goal
from clutter6d.envs.vector_env import ClutterVectorEnv
from clutter6d.envs.warp_env import WarpVectorEnv
from clutter6d.envs.warp_slots import WarpSlots
from clutter6d.errors import InvalidValueError, UnknownNameError
from clutter6d.seeding import generator
from clutter6d.sim.kinematics import hand_pose
from clutter6d.sim.warp_runtime import torch
from tests.scene_fixtures import make_box_scene, make_box_scene_set
from tests.warp_fixtures import DEVICES, compile_quickly, skip_without

SLOTS = 4
SCENES = make_box_scene_set(5)
ALL = np.arange(SLOTS)
TOLERANCE = 1e-4


@pytest.fixture(scope="module", params=DEVICES)
def device(request):
    compile_quickly()
    return skip_without(request.param)


def make_env(device, **options):
    return WarpVectorEnv(SLOTS, device=device, split=SCENES, **options)


def actions(step: int) -> np.ndarray:
    return generator(0, "actions", step).uniform(-0.1, 0.1, size=(SLOTS, 7)).astype(np.float32)


def slots_in_one_state(device) -> tuple[ClutterSlots, WarpSlots]:
    """Both engines' slots in the same states: moving; pushed by a finger; at the goal; fallen off the table."""
    made = [make_box_scene(index) for index in range(SLOTS)]
    models, pairs = [model for _, model in made], [scene.goal_pairs[1] for scene, _ in made]
    ours, reference = WarpSlots(models, device=device), ClutterSlots(models, threads=1)
    for slots in (ours, reference):
        slots.load(ALL, models, pairs)
    rng, batch = generator(0, "states"), ours.batch
    batch.arm_qpos += torch.as_tensor(rng.uniform(-0.3, 0.3, (SLOTS, 7))).to(batch.arm_qpos)
    batch.arm_qvel.copy_(torch.as_tensor(rng.uniform(-1, 1, (SLOTS, 7))))
    batch.object_velocities.copy_(torch.as_tensor(rng.uniform(-1, 1, (SLOTS, 4, 6))))
    batch.object_poses[..., :2] += torch.as_tensor(rng.uniform(-0.1, 0.1, (SLOTS, 4, 2))).to(batch.object_poses)
    hand = hand_pose(batch.arm_qpos.double().cpu().numpy())
    batch.object_poses[1, 0, :3] = torch.as_tensor(hand[1, :3] - (0, 0, 0.12)).to(batch.object_poses)
    batch.object_poses[2, 0] = torch.as_tensor(reference.goals[2]).to(batch.object_poses)
    batch.object_poses[3, 2, 2] = -0.2
    for name in ("arm_qpos", "arm_qvel", "object_poses", "object_velocities"):
        getattr(reference.batch, name)[:] = getattr(ours.state, name).cpu().numpy()
    return reference, ours


def test_equal_states_are_observed_rewarded_and_ended_alike(device):
    reference, ours = slots_in_one_state(device)
    expected, seen = reference.observe(), ours.observe()
    assert set(seen) == set(expected)
    for name, value in expected.items():
        assert seen[name].dtype == torch.float32
        assert seen[name].device.type == device
        assert np.abs(seen[name].cpu().numpy() - value).max() < TOLERANCE, name
    terms, wanted = ours.reward(), reference.reward()
    for name in ("proximity", "coarse", "fine", "success", "total"):
        assert np.abs(getattr(terms, name).cpu().numpy() - getattr(wanted, name)).max() < TOLERANCE, name
    assert (wanted.coarse > 0).tolist()[1]
    assert (wanted.success > 0).tolist() == [False, False, True, False]


def test_equal_states_have_equal_errors_and_outcomes(device):
    reference, ours = slots_in_one_state(device)
    errors, wanted = ours.errors(), reference.errors(ALL)
    for name in ("position_m", "planar_m", "rotation_rad"):
        assert np.abs(getattr(errors, name).cpu().numpy() - getattr(wanted, name)).max() < 1e-6, name
    config = reference.config.termination
    expected = find_outcome(
        is_success=is_at_goal(wanted.position_m, wanted.rotation_rad, config),
        dropped=reference.is_dropped(ALL),
        is_unstable=np.zeros(SLOTS, dtype=bool),
        steps=reference.steps,
        config=config,
    )
    numbers = ours.outcomes(errors, torch.zeros(SLOTS, dtype=torch.bool, device=ours.batch.device))
    found = tuple(None if number < 0 else OUTCOMES[number] for number in numbers.tolist())
    assert found == expected == (None, None, "success", "drop")


def test_the_same_seed_begins_the_same_episodes_with_the_same_physics_as_on_the_cpu(device):
    config = EnvConfig(randomisation=MODEST_RANDOMISATION, mass_scale={"target": 2.0}, has_object_states=True)
    ours, theirs = make_env(device, config=config), ClutterVectorEnv(SLOTS, split=SCENES, config=config)
    seen, info = ours.reset(seed=3)
    expected, wanted = theirs.reset(seed=3)
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    assert set(seen) == set(expected)
    for name, value in expected.items():
        assert np.abs(seen[name].cpu().numpy() - value).max() < TOLERANCE, name
    assert set(info) == set(wanted)
    assert info["scene_id"].tolist() == wanted["scene_id"].tolist()
    assert info["pair"].tolist() == wanted["pair"].tolist()


@pytest.mark.slow
def test_a_step_gives_what_the_cpus_gives(device):
    ours, theirs = make_env(device), ClutterVectorEnv(SLOTS, split=SCENES)
    ours.reset(seed=3)
    theirs.reset(seed=3)
    seen, reward, terminated, truncated, info = ours.step(torch.from_numpy(actions(0)))
    expected, wanted_reward, wanted_end, wanted_cut, wanted = theirs.step(actions(0))
    for name, value in expected.items():
        # The boxes begin exactly on the table: whether they touch it in the first 5 ms is a matter of rounding.
        assert np.abs(seen[name].cpu().numpy() - value).max() < 5e-3, name
    assert np.abs(reward.cpu().numpy() - wanted_reward).max() < TOLERANCE
    assert terminated.tolist() == wanted_end.tolist()
    assert truncated.tolist() == wanted_cut.tolist()
    assert set(info) == set(wanted)
    assert set(info["reward_terms"]) == set(wanted["reward_terms"])
    assert info["outcome"].tolist() == [-1] * SLOTS


@pytest.mark.slow
def test_an_episode_that_is_over_begins_anew_in_the_next_step(device):
    env = make_env(device, max_episode_steps=2)
    start, _ = env.reset(seed=0)
    env.step(actions(0))
    _, _, terminated, truncated, info = env.step(actions(1))
    assert truncated.all()
    assert not terminated.any()
    assert [OUTCOMES[number] for number in info["outcome"].tolist()] == ["timeout"] * SLOTS
    seen, reward, terminated, truncated, info = env.step(actions(2))
    assert not truncated.any()
    assert (reward == 0).all()
    assert not info["_outcome"].any()
    assert (seen["previous_action"] == 0).all()
    assert torch.equal(seen["hand_state"], start["hand_state"])
    assert not env.step(actions(3))[3].any()


@pytest.mark.slow
def test_in_the_same_step_the_end_of_an_episode_is_kept_beside_the_next_ones_start(device):
    env = make_env(device, max_episode_steps=1, autoreset_mode=AutoresetMode.SAME_STEP)
    start, begun = env.reset(seed=0)
    seen, _, _, truncated, info = env.step(actions(0))
    assert truncated.all()
    assert info["_final_obs"].all()
    assert torch.equal(info["final_obs"]["previous_action"].cpu(), torch.from_numpy(actions(0)))
    assert (seen["previous_action"] == 0).all()
    assert torch.equal(seen["joint_state"], start["joint_state"])
    assert not info["_outcome"].any()
    assert not info["reward_terms"]["_fine"].any()
    assert info["final_info"]["_outcome"].all()
    assert info["final_info"]["scene_id"].tolist() == begun["scene_id"].tolist()


@pytest.mark.slow
def test_without_autoreset_chosen_environments_are_reset_by_a_mask(device):
    env = make_env(device, max_episode_steps=1, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=0)
    env.step(actions(0))
    with pytest.raises(InvalidValueError, match=r"environments \[0, 1, 2, 3\] are over"):
        env.step(actions(1))
    mask = np.array([True, False, True, False])
    _, info = env.reset(options={"reset_mask": mask, "scene_id": "boxes-1", "pair": 1})
    assert info["_pair"].tolist() == mask.tolist()
    assert info["scene_id"][mask].tolist() == ["boxes-1"] * 2


@pytest.mark.slow
def test_an_invalid_state_ends_its_episode_and_is_reported(device, caplog):
    env = make_env(device)
    env.reset(seed=0)
    env.slots.batch.arm_qvel[2] = torch.inf
    _, _, terminated, _, info = env.step(actions(0))
    assert terminated.tolist() == [False, False, True, False]
    assert OUTCOMES[info["outcome"][2]] == "unstable"
    assert "invalid state" in caplog.text


def test_wrong_actions_and_options_are_refused_in_one_line(device):
    env = make_env(device)
    with pytest.raises(ResetNeeded):
        env.step(actions(0))
    env.reset(seed=0)
    with pytest.raises(InvalidValueError, match=r"shape \(3, 7\), expected \(4, 7\)"):
        env.step(actions(0)[:3])
    bad = actions(0)
    bad[1] = np.nan
    with pytest.raises(InvalidValueError, match=r"environments \[1\] are not finite"):
        env.step(bad)
    for config, said in (
        (EnvConfig(noise=DISTILLATION_NOISE), "noise"),
        (EnvConfig(cameras=DEFAULT_CAMERAS), "camera"),
    ):
        with pytest.raises(InvalidValueError, match=said):
            make_env(device, config=config)
    with pytest.raises(InvalidValueError, match="num_envs is 0"):
        WarpVectorEnv(0, device=device, split=SCENES)
    with pytest.raises(UnknownNameError, match="autoreset mode"):
        make_env(device, autoreset_mode="sometimes")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"device": "cuda", "render_mode": "rgb_array"}, "render_mode is not available"),
        ({"device": "cuda", "threads": 2}, "threads is not available"),
        ({"device": "abacus"}, "device 'abacus' is unknown"),
    ],
)
def test_gymnasium_makes_it_by_the_device_or_says_why_not(options, said):
    with pytest.raises(InvalidValueError, match=said):
        gymnasium.make_vec("Clutter6D-Sparse-v1", num_envs=2, split=SCENES, **options)


@pytest.mark.parametrize("package", ["torch", pytest.param("mujoco_warp", marks=pytest.mark.slow)])
def test_without_the_extra_the_message_says_what_to_install(package):
    code = f"""
import sys
sys.modules["{package}"] = None
from clutter6d.envs.devices import make_vector_env
from clutter6d.errors import MissingDependencyError
try:
    make_vector_env(device="cuda")
except MissingDependencyError as error:
    print(error.exit_code, error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (
        done.stdout
        == f"2 the GPU back end needs {package}, which is not installed; run: pip install 'clutter6d[gpu]'\n"
    )


def test_an_evaluation_never_loads_the_gpu_back_end(tmp_path):
    code = f"""
import sys
from clutter6d.cli import run
from tests.scene_fixtures import write_box_scene_set
from pathlib import Path
write_box_scene_set(Path({str(tmp_path / "scenes")!r}), 1)
assert run(["evaluate", "--policy", "random", "--scenes", {str(tmp_path / "scenes")!r}, "--pairs", "1",
            "--out", {str(tmp_path / "results")!r}]) == 0
loaded = {{"torch", "warp", "mujoco_warp"}} & set(sys.modules)
assert not loaded, loaded
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
