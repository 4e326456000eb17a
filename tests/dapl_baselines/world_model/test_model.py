import pytest
import torch
from pydantic import ValidationError

from dapl_baselines.encoders.dapl import DaplEncoderConfig
from dapl_baselines.world_model.loss import LossConfig, world_model_loss
from dapl_baselines.world_model.model import WorldModel, WorldModelConfig
from dapl_baselines.world_model.prediction import STEP_S, ObjectPrediction
from dapl_baselines.world_model.presets import PRESETS
from tests.dapl_baselines.cloud_fixtures import make_step

SMALL = {"token_size": 32, "blocks": 2, "heads": 4, "patch_hidden_sizes": (8, 16)}


def make_config(**changes) -> WorldModelConfig:
    features = changes.pop("features", "xyz_mass_velocity")
    return WorldModelConfig(**changes, encoder=DaplEncoderConfig(**SMALL, features=features))


def make_model(config: WorldModelConfig, *, trained: bool = True) -> WorldModel:
    torch.manual_seed(0)
    model = WorldModel(config)
    if trained:
        with torch.no_grad():
            for name, parameter in model.heads.named_parameters():
                if "bias" not in name:
                    parameter.normal_(std=0.3)
    model.update_statistics(make_step(4, seed=7)[0])
    return model.eval()


def small(preset: str) -> WorldModelConfig:
    config = PRESETS[preset]
    return make_config(task=config.task, predicts=config.predicts, features=config.encoder.features)


@pytest.mark.parametrize("features", ["xyz", "xyz_velocity", "xyz_mass_velocity"])
def test_a_fresh_model_predicts_constant_velocity_where_it_sees_velocities(features):
    cloud, flow, _, _ = make_step(2)
    with torch.no_grad():
        prediction = make_model(make_config(task="points", features=features), trained=False)(cloud, flow)
    velocities = torch.zeros(2, 1280, 3) if features == "xyz" else cloud[..., 4:]
    assert torch.allclose(prediction.positions, cloud[..., :3] + STEP_S * velocities, atol=1e-6)
    assert torch.allclose(prediction.velocities, velocities, atol=1e-6)


def test_a_fresh_model_of_the_targets_pose_predicts_that_nothing_moves():
    cloud, flow, _, _ = make_step(2)
    with torch.no_grad():
        prediction = make_model(make_config(task="object"), trained=False)(cloud, flow)
    assert torch.allclose(prediction.positions, cloud[..., :3], atol=1e-6)
    assert torch.allclose(prediction.velocities, torch.zeros(2, 1280, 3), atol=1e-5)


def test_coordinates_of_a_fresh_model_are_the_mean_of_what_it_has_seen():
    cloud, flow, _, _ = make_step(2)
    model = make_model(make_config(predicts="coordinates"), trained=False)
    with torch.no_grad():
        positions = model(cloud, flow).positions
    assert torch.allclose(positions, make_step(4, seed=7)[0][..., :3].mean(dim=(0, 1)).expand_as(positions), atol=1e-5)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_trains_all_its_parameters_and_gets_better(preset):
    config, (cloud, flow, positions, velocities) = small(preset), make_step(4)
    model = make_model(config).train()
    optimiser = torch.optim.AdamW(model.parameters(), lr=3e-3)
    losses: list[float] = []
    for _ in range(8):
        loss = world_model_loss(model(cloud, flow), cloud, positions, velocities, config, LossConfig())
        optimiser.zero_grad()
        loss.total.backward()
        optimiser.step()
        losses.append(float(loss.total.detach()))
    still = [name for name, parameter in model.named_parameters() if not parameter.grad.abs().sum() > 0]
    # A reconstruction has no action, and does not give velocities that it was not given.
    unused = ("fusion.action_embedding.weight", "heads.velocity")
    assert all(config.task == "reconstruction" and name.startswith(unused) for name in still)
    assert losses[-1] < 0.8 * losses[0]


def test_predictions_follow_the_action_but_a_reconstructions_do_not():
    cloud, flow, _, _ = make_step(2)
    for preset in PRESETS:
        model = make_model(small(preset))
        with torch.no_grad():
            one, other = model(cloud, flow).positions, model(cloud, flow + 0.05).positions
        assert torch.equal(one, other) == preset.startswith("reconstruction")


@pytest.mark.parametrize("preset", ["points-xyz", "object-xyz", "reconstruction-xyz"])
def test_who_does_not_see_mass_and_velocity_cannot_tell_them_apart(preset):
    cloud, flow, _, _ = make_step(2)
    other = cloud.clone()
    other[..., 3:] += 0.5
    model = make_model(small(preset))
    with torch.no_grad():
        one, two = model(cloud, flow), model(other, flow)
    assert torch.equal(one.positions, two.positions)
    assert torch.equal(one.velocities, two.velocities)


def test_the_object_model_moves_the_target_rigidly_and_nothing_else():
    cloud, flow, _, _ = make_step(2)
    with torch.no_grad():
        prediction = make_model(make_config(task="object"))(cloud, flow)
    assert isinstance(prediction, ObjectPrediction)
    assert torch.equal(prediction.positions[:, 512:], cloud[:, 512:, :3])
    before, after = (torch.cdist(points[:, :50], points[:, :50]) for points in (cloud[..., :3], prediction.positions))
    assert torch.allclose(before, after, atol=1e-3)
    shift = prediction.positions[:, :512].mean(dim=1) - cloud[:, :512, :3].mean(dim=1)
    assert torch.allclose(shift, prediction.translation, atol=1e-5)


def test_a_rows_prediction_does_not_depend_on_the_others():
    cloud, flow, _, _ = make_step(40)
    model = make_model(make_config())
    with torch.no_grad():
        together = model(cloud, flow).positions
        for row in (0, 33):
            assert torch.allclose(
                model(cloud[row : row + 1], flow[row : row + 1]).positions[0], together[row], atol=1e-5
            )


@pytest.mark.parametrize("preset", PRESETS)
def test_bfloat16_is_near_float32(preset):
    cloud, flow, _, _ = make_step(2)
    model = make_model(small(preset))
    with torch.inference_mode():
        exact = model(cloud, flow).positions
        with torch.autocast("cpu", dtype=torch.bfloat16):
            rough = model(cloud, flow).positions
    assert rough.dtype == torch.float32
    change = (exact - cloud[..., :3]).abs().mean()
    assert (rough - exact).abs().mean() < 0.05 * change


def test_the_papers_world_model_is_an_encoder_with_a_small_decoder():
    model = WorldModel(WorldModelConfig())
    encoder, whole = (sum(each.numel() for each in part.parameters()) for part in (model.encoder, model))
    action, attention, mlp, norms = 4 * 128, 4 * (128 * 128 + 128), 2 * 128 * 512 + 512 + 128, 3 * 2 * 128
    offsets, head = 4 * 64 + 65 * 128, 129 * 64 + 65 * 4
    assert encoder == 2_392_512
    assert whole - encoder == action + attention + mlp + norms + offsets + 2 * 128 + 2 * head == 224_904


def test_the_presets_are_the_seven_rows_of_the_ablation():
    rows = [(config.task, config.encoder.features) for config in PRESETS.values()]
    assert rows == [
        ("reconstruction", "xyz"),
        ("reconstruction", "xyz_mass_velocity"),
        ("object", "xyz"),
        ("object", "xyz_mass_velocity"),
        ("points", "xyz"),
        ("points", "xyz_velocity"),
        ("points", "xyz_mass_velocity"),
    ]
    assert PRESETS["points"] == WorldModelConfig()


def test_a_reconstruction_is_not_given_its_answer():
    with pytest.raises(ValidationError, match="must predict 'coordinates'"):
        WorldModelConfig(task="reconstruction")
