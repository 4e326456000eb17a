import io
import pickle
import zipfile
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from clutter6d.cli import run  # noqa: E402
from clutter6d.envs.slots import ClutterSlots  # noqa: E402
from clutter6d.errors import InvalidFileError, InvalidValueError, MissingFileError, UnknownNameError  # noqa: E402
from clutter6d.eval.policy import Episode, PolicyInput  # noqa: E402
from clutter6d.eval.policy_loading import load_policy  # noqa: E402
from clutter6d.seeding import generator  # noqa: E402
from dapl_baselines.checkpoint import TrainingRecord, read_checkpoint, write_checkpoint  # noqa: E402
from dapl_baselines.policy.config import PolicyNetworkConfig  # noqa: E402
from dapl_baselines.policy.network import PolicyNetwork  # noqa: E402
from tests.scene_fixtures import make_box_scene, write_box_scene_set  # noqa: E402

CONFIG = PolicyNetworkConfig(fusion_sizes=(64, 32), head_sizes=(16,))


def make_module(seed: int = 0) -> PolicyNetwork:
    module = PolicyNetwork(CONFIG)
    rng = generator(seed, "weights")
    with torch.no_grad():
        for tensor in module.parameters():
            tensor.copy_(torch.from_numpy(rng.normal(scale=0.2, size=tuple(tensor.shape)).astype(np.float32)))
    return module


@pytest.fixture
def path(tmp_path) -> Path:
    history = (TrainingRecord(method="ppo", steps=1000, unit="environment steps", seed=0, settings={"clip": 0.3}),)
    file = tmp_path / "policy.pt"
    write_checkpoint(file, architecture="policy-network", config=CONFIG, module=make_module(), history=history)
    return file


def content_of(path: Path) -> dict:
    return torch.load(path, weights_only=True)


def test_a_checkpoint_comes_back_as_it_was(path):
    checkpoint = read_checkpoint(path)
    for name, tensor in make_module().state_dict().items():
        assert torch.equal(checkpoint.module.state_dict()[name], tensor)
    assert checkpoint.header.history[0].settings == {"clip": 0.3}


def test_the_policy_hash_follows_weights_and_configuration_and_not_the_history(path, tmp_path):
    first = load_policy(str(path)).policy_hash
    write_checkpoint(tmp_path / "same.pt", architecture="policy-network", config=CONFIG, module=make_module())
    write_checkpoint(tmp_path / "other.pt", architecture="policy-network", config=CONFIG, module=make_module(1))
    assert load_policy(str(tmp_path / "same.pt")).policy_hash == first
    assert load_policy(str(tmp_path / "other.pt")).policy_hash != first


def test_actions_stay_within_the_action_scale_and_follow_the_observation(path):
    scene, model = make_box_scene()
    env, slots = ClutterSlots([model] * 2, threads=1), np.arange(2)
    env.load(slots, [model] * 2, list(scene.goal_pairs))
    policy = load_policy(str(path))
    episodes = tuple(Episode(scene=scene, pair_index=pair, scene_model=model, seed=0) for pair in range(2))
    policy.begin(slots, episodes)
    observation = env.observe()
    actions = policy.act(
        PolicyInput(slots=slots, episodes=episodes, steps=np.zeros(2, int), observation=observation, states=None)
    )
    assert np.abs(actions).max() <= np.float32(0.1)
    assert not np.array_equal(actions[0], actions[1])


class Bomb:
    """Creates a file when it is unpickled."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self):
        return (Path.touch, (self.trace,))


def as_pickle(path, trace):
    path.write_bytes(pickle.dumps({"format": "clutter6d-checkpoint", "state_dict": Bomb(trace)}))


def as_legacy_torch_file(path, trace):
    torch.save({"state_dict": Bomb(trace)}, path, _use_new_zipfile_serialization=False)


def as_torch_file(path, trace):
    torch.save({**content_of(path), "history": [Bomb(trace)]}, path)


def as_whole_module(path, trace):
    torch.save(make_module(), path)


@pytest.mark.parametrize("write", [as_pickle, as_legacy_torch_file, as_torch_file, as_whole_module])
def test_a_pickle_bomb_is_refused_and_does_not_go_off(path, tmp_path, write):
    trace = tmp_path / "boom"
    write(path, trace)
    with pytest.raises(InvalidFileError, match=r"policy\.pt: not a checkpoint") as caught:
        load_policy(str(path))
    assert "\n" not in str(caught.value)
    assert not trace.exists()


def without(*names):
    return lambda content: {name: value for name, value in content.items() if name not in names}


def with_tensor(name, change):
    def apply(content):
        content["state_dict"][name] = change(content["state_dict"][name])
        return content

    return apply


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without("state_dict"), "'state_dict' is missing"),
        (without("format"), "format: Field required"),
        (without("architecture"), "architecture"),
        (lambda content: {**content, "format": "something else"}, "format"),
        (lambda content: {**content, "schema_version": 2}, "schema_version"),
        (lambda content: {**content, "extra": 1}, "extra"),
        (lambda content: {**content, "config": {"fusion_sizes": [64]}}, "tensor"),
        (lambda content: {**content, "config": {"fusion_sizes": [10**9]}}, "fusion_sizes"),
        (lambda content: {**content, "config": {"layers": 3}}, "layers"),
        (lambda content: {**content, "config": torch.zeros(3)}, "config"),
        (lambda content: {**content, "weights_sha256": "0" * 64}, "not those it was written with"),
        (lambda content: {**content, "state_dict": [1, 2]}, "state_dict"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: tensor[:1]), "trunk.fusion.0.weight"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: tensor.double()), "trunk.fusion.0.weight"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: tensor.to_sparse()), "trunk.fusion.0.weight"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: tensor * float("nan")), "not finite"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: tensor + 1), "not those it was written with"),
        (with_tensor("trunk.fusion.0.weight", lambda tensor: 3.0), "not a dense tensor"),
        (lambda content: [content], "no dictionary"),
        (lambda content: {3: content}, "no dictionary"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_with_the_reason(path, change, said):
    torch.save(change(content_of(path)), path)
    with pytest.raises(InvalidFileError, match=said) as caught:
        read_checkpoint(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_architecture_is_named(path):
    torch.save({**content_of(path), "architecture": "policy-netwrok"}, path)
    with pytest.raises(UnknownNameError, match="did you mean 'policy-network'"):
        read_checkpoint(path)


def test_a_compressed_archive_is_refused(path):
    buffer = io.BytesIO()
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as target:
        for member in source.infolist():
            target.writestr(member.filename, source.read(member))
    path.write_bytes(buffer.getvalue())
    with pytest.raises(InvalidFileError, match="compressed"):
        read_checkpoint(path)


def test_a_truncated_or_missing_or_empty_file_is_refused(path):
    content = path.read_bytes()
    for part in (content[: len(content) // 2], content[:-1], b""):
        path.write_bytes(part)
        with pytest.raises(InvalidFileError, match="not a checkpoint"):
            read_checkpoint(path)
    path.unlink()
    with pytest.raises(MissingFileError):
        read_checkpoint(path)


def test_evaluate_and_replay_take_a_checkpoint(path, tmp_path):
    write_box_scene_set(tmp_path / "scenes", 1)
    options = [
        "--scenes",
        str(tmp_path / "scenes"),
        "--out",
        str(tmp_path / "out"),
        "--max-steps",
        "5",
        "--threads",
        "1",
    ]
    assert run(["evaluate", "--policy", str(path), *options]) == 0
    assert run(["replay", str(tmp_path / "out"), "--threads", "1"]) == 0


def test_evaluate_refuses_a_bomb_with_exit_code_2(path, tmp_path, capsys):
    as_torch_file(path, tmp_path / "boom")
    write_box_scene_set(tmp_path / "scenes", 1)
    code = run(
        ["evaluate", "--policy", str(path), "--scenes", str(tmp_path / "scenes"), "--out", str(tmp_path / "out")]
    )
    assert code == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "boom").exists()
    assert not (tmp_path / "out").exists()


def test_half_precision_reads_back_exactly_as_stored_and_takes_half_the_room(path, tmp_path):
    half, again = tmp_path / "half.pt", tmp_path / "again.pt"
    header = write_checkpoint(
        half, architecture="policy-network", config=CONFIG, module=make_module(), history=(), precision="float16"
    )
    module = read_checkpoint(half).module
    for name, tensor in make_module().named_parameters():
        assert torch.equal(dict(module.named_parameters())[name], tensor.half().float())
    assert module.trunk.statistics.mean.dtype == torch.float32
    assert (
        write_checkpoint(again, architecture="policy-network", config=CONFIG, module=module, precision="float16")
        == header
    )
    assert half.stat().st_size < 0.7 * path.stat().st_size
    assert load_policy(str(half)).policy_hash == header.policy_hash() != load_policy(str(path)).policy_hash


def test_a_precision_that_the_weights_are_not_stored_in_is_refused(path):
    torch.save({**content_of(path), "precision": "float16"}, path)
    with pytest.raises(InvalidFileError, match="is torch.float32"):
        read_checkpoint(path)


def test_a_weight_too_large_for_half_precision_is_not_written(tmp_path):
    module = make_module()
    with torch.no_grad():
        module.trunk.fusion[0].weight[0, 0] = 1e6
    with pytest.raises(
        InvalidValueError, match=r"trunk\.fusion\.0\.weight' holds values that are not finite in float16"
    ):
        write_checkpoint(
            tmp_path / "x.pt", architecture="policy-network", config=CONFIG, module=module, precision="float16"
        )
    assert not (tmp_path / "x.pt").exists()
