import json
import warnings

import numpy as np
import onnx
import pytest
import torch

from clutter6d.cli import run
from clutter6d.errors import InvalidFileError, MissingFileError
from clutter6d.eval.policy import PolicyInput
from clutter6d.eval.policy_loading import load_policy
from dapl_baselines.checkpoint import read_checkpoint, write_checkpoint
from dapl_baselines.cli import PROGRAM
from dapl_baselines.policy.config import PolicyNetworkConfig
from dapl_baselines.policy.network import PolicyNetwork
from dapl_baselines.serving import export as export_file
from dapl_baselines.serving.export import ExportError, export_policy, play, run_onnx, run_torchscript, trial_observation
from dapl_baselines.serving.manifest import TensorSpec, input_specs, read_exported, read_manifest
from dapl_baselines.serving.onnx_policy import OnnxPolicy
from dapl_baselines.serving.served_policy import EvaluatedPolicy

BOTH = ("onnx", "torchscript")
NAMES = ["state", "memory", *(pytest.param(name, marks=pytest.mark.slow) for name in ("points", "target-points"))]


def actions_of_checkpoint(path, episode):
    """Of the policy as an evaluation would ask for them, one observation after the other."""
    policy, actions = load_policy(str(path)), []
    policy.begin(np.array([0]), ())
    for step, rows in enumerate(episode):
        inputs = PolicyInput(slots=np.array([0]), episodes=(), steps=np.array([step]), observation=rows, states=None)
        actions.append(policy.act(inputs)[0])
    return np.array(actions)


@pytest.fixture
def exported(export):
    return export("state")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("kind", "runner"), [("onnx", run_onnx), ("torchscript", run_torchscript)])
def test_an_export_acts_as_the_checkpoint(checkpoints, export, name, kind, runner):
    manifest = read_manifest(export(name))
    trials = [trial_observation(manifest.inputs, seed) for seed in range(100, 110)]
    actions = play(runner(read_exported(export(name), manifest, kind)), trials, manifest.memory)
    episode = [dict(zip(manifest.fields, rows, strict=True)) for rows in trials]
    expected = actions_of_checkpoint(checkpoints[name], episode)
    assert (np.abs(expected).max(axis=1) > 0.005).all()
    np.testing.assert_allclose(actions, expected, atol=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_the_manifest_says_what_goes_in_and_comes_out(checkpoints, export, name):
    manifest = read_manifest(export(name))
    assert manifest.policy_hash == read_checkpoint(checkpoints[name]).header.policy_hash()
    assert manifest.policy == load_policy(str(checkpoints[name])).name
    assert manifest.inputs == input_specs(manifest.fields)
    assert manifest.action_scale_rad == 0.1
    assert {file.format for file in manifest.files} == set(BOTH)
    assert all(file.parity_rad < 1e-6 for file in manifest.files)


def test_the_files_say_what_they_are_without_the_manifest(exported):
    manifest = read_manifest(exported)
    model = onnx.load_from_string(read_exported(exported, manifest, "onnx"))
    assert {item.key: item.value for item in model.metadata_props}["policy_hash"] == manifest.policy_hash
    shapes = {item.name: [size.dim_value for size in item.type.tensor_type.shape.dim] for item in model.graph.input}
    assert shapes == {spec.name: list(spec.shape) for spec in manifest.inputs}
    extra = {"policy_hash": ""}
    warnings.simplefilter("ignore")  # PyTorch would have us use its own export
    torch.jit.load(exported / "policy.torchscript", _extra_files=extra)
    assert extra["policy_hash"].decode() == manifest.policy_hash


def test_an_export_is_the_same_to_the_bit_each_time_it_is_asked(exported, observation):
    policies = [OnnxPolicy(exported) for _ in range(2)]
    actions = [policy.act(0, observation) for policy in policies * 3]
    assert all(np.array_equal(action, actions[0]) for action in actions)


def test_an_exported_memory_belongs_to_a_slot_and_to_an_episode(checkpoints, export, observation):
    served, loaded = OnnxPolicy(export("memory")), EvaluatedPolicy(load_policy(str(checkpoints["memory"])))
    assert served.manifest.memory == TensorSpec(name="memory", shape=(1, 2, 33))
    actions = {}
    for policy in (served, loaded):
        for slot in (0, 1):
            policy.begin(slot)
        first = policy.act(0, observation)
        assert np.array_equal(policy.act(1, observation), first)
        second = policy.act(0, observation)
        assert not np.allclose(second, first)
        assert np.array_equal(policy.act(1, observation), second)
        policy.begin(0)
        assert np.array_equal(policy.act(0, observation), first)
        actions[policy] = second
    np.testing.assert_allclose(actions[served], actions[loaded], atol=1e-6)


def test_an_export_that_differs_is_refused(checkpoints, tmp_path, monkeypatch):
    monkeypatch.setattr(export_file, "TOLERANCE_RAD", -1.0)
    with pytest.raises(ExportError, match="the torchscript export gives actions that are"):
        list(export_policy(checkpoints["state"], tmp_path, ("torchscript",)))
    assert not list(tmp_path.iterdir())


def test_a_policy_that_needs_the_simulator_is_refused(tmp_path):
    config = PolicyNetworkConfig(state_parts=("hand_state", "object_states"), objects=4, fusion_sizes=(8,))
    write_checkpoint(
        tmp_path / "teacher.pt", architecture="policy-network", config=config, module=PolicyNetwork(config)
    )
    with pytest.raises(InvalidFileError, match="needs object_states, which only a simulation knows"):
        list(export_policy(tmp_path / "teacher.pt", tmp_path / "out", BOTH))


def damage(**changes):
    def apply(folder):
        path = folder / "policy.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))

    return apply


def cut_model(folder):
    path = folder / "policy.onnx"
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (cut_model, "is not the file that policy.json was written for"),
        (damage(inputs=[{"name": "hand_state", "shape": [1, 8]}]), "not those of a policy of this version"),
        (damage(inputs=[{"name": "secrets", "shape": [1, 9]}]), "not those of a policy of this version"),
        (damage(memory={"name": "memory", "shape": [1, 10**9, 33]}), "not those of a policy of this version"),
        (damage(memory={"name": "diary", "shape": [1, 2, 33]}), "not those of a policy of this version"),
        (damage(format="zip"), "format"),
        (damage(files=[]), "files"),
        (damage(files=[{"format": "../../x", "sha256": "0" * 64, "parity_rad": 0}]), "files"),
        (damage(action_scale_rad=float("nan")), "action_scale_rad"),
        (damage(extra=1), "extra"),
    ],
)
def test_a_folder_that_is_not_what_was_exported_is_refused(exported, tmp_path, change, said):
    for path in exported.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    change(tmp_path)
    with pytest.raises(InvalidFileError, match=said) as caught:
        OnnxPolicy(tmp_path)
    assert "\n" not in str(caught.value)


def test_a_format_that_was_not_exported_is_named(checkpoints, tmp_path):
    list(export_policy(checkpoints["state"], tmp_path, ("torchscript",)))
    with pytest.raises(MissingFileError, match="export it with --format onnx"):
        OnnxPolicy(tmp_path)


def test_the_command_exports(checkpoints, tmp_path, capsys):
    command = ["export", str(checkpoints["state"]), "--format", "torchscript", "--out", str(tmp_path)]
    assert run(command, PROGRAM) == 0
    assert "rad from the checkpoint" in capsys.readouterr().out
    assert sorted(path.name for path in tmp_path.iterdir()) == ["policy.json", "policy.torchscript"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing.pt"], "checkpoint not found"),
        (["{state}", "--format", "onxx"], "did you mean 'onnx'"),
        (["{state}", "--format", ","], "names none"),
    ],
)
def test_the_command_says_what_is_wrong_in_one_line(checkpoints, capsys, arguments, said):
    assert run(["export", *(item.format(**checkpoints) for item in arguments)], PROGRAM) == 2
    shown = capsys.readouterr().err
    assert said in shown
    assert shown.count("\n") == 1
