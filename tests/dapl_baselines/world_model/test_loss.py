import math

import pytest
import torch

from dapl_baselines.world_model.loss import LossConfig, object_loss, point_loss, reconstruction_loss, spread_error
from dapl_baselines.world_model.prediction import ObjectPrediction, Prediction
from dapl_baselines.world_model.rigid_motion import matrix_from_6d, move_rigidly
from tests.dapl_baselines.cloud_fixtures import make_step


def make_prediction(rows: int = 2) -> tuple[Prediction, torch.Tensor, torch.Tensor, torch.Tensor]:
    torch.manual_seed(0)
    cloud, _, positions, velocities = make_step(rows)
    guess = Prediction(positions=positions + 0.01 * torch.randn_like(positions), velocities=0.5 * velocities + 0.01)
    return guess, cloud, positions, velocities


def variance_by_loops(velocities: torch.Tensor, axis: int) -> float:
    values = [float(point[axis]) / 0.1 for row in velocities for point in row]
    mean = sum(values) / len(values)
    return sum((value - mean) ** 2 for value in values) / len(values)


def squared_error_by_loops(values: torch.Tensor, truth: torch.Tensor, unit: float) -> float:
    total, points = 0.0, 0
    for row in range(len(values)):
        for point in range(values.shape[1]):
            total += sum(float((values[row, point, axis] - truth[row, point, axis]) / unit) ** 2 for axis in range(3))
            points += 1
    return total / points


def test_the_point_loss_is_the_papers_in_plain_loops():
    guess, _, positions, velocities = make_prediction()
    loss = point_loss(guess, positions, velocities, LossConfig())
    position = squared_error_by_loops(guess.positions, positions, 0.01)
    velocity = squared_error_by_loops(guess.velocities, velocities, 0.1)
    variance = sum(
        (variance_by_loops(guess.velocities, axis) - variance_by_loops(velocities, axis)) ** 2 for axis in range(3)
    )
    assert float(loss.terms["position"]) == pytest.approx(position, rel=1e-4)
    assert float(loss.terms["velocity"]) == pytest.approx(velocity, rel=1e-4)
    assert float(loss.terms["variance"]) == pytest.approx(variance, rel=1e-4)
    assert float(loss.total) == pytest.approx(position + velocity + 100 * variance, rel=1e-4)


def test_the_main_texts_spread_is_the_length_of_the_difference_of_standard_deviations():
    guess, _, _, velocities = make_prediction()
    differences = [
        math.sqrt(variance_by_loops(guess.velocities, axis)) - math.sqrt(variance_by_loops(velocities, axis))
        for axis in range(3)
    ]
    spread = spread_error(guess.velocities, velocities, "standard_deviation")
    assert float(spread) == pytest.approx(math.hypot(*differences), rel=1e-3)


@pytest.mark.parametrize("spread", ["variance", "standard_deviation"])
def test_the_spread_of_equal_velocities_costs_nothing_and_has_a_finite_slope(spread):
    still = torch.zeros(2, 30, 3, requires_grad=True)
    error = spread_error(still, torch.zeros(2, 30, 3), spread)
    error.backward()
    assert float(error.detach()) == 0
    assert torch.isfinite(still.grad).all()


def test_a_model_that_predicts_no_motion_pays_for_it():
    _, _, _, velocities = make_prediction(8)
    assert spread_error(torch.zeros_like(velocities), velocities, "variance") > spread_error(
        0.9 * velocities, velocities, "variance"
    )


def test_the_loss_does_not_depend_on_how_often_the_batch_is_repeated():
    guess, _, positions, velocities = make_prediction()
    twice = Prediction(positions=guess.positions.repeat(2, 1, 1), velocities=guess.velocities.repeat(2, 1, 1))
    once = point_loss(guess, positions, velocities, LossConfig())
    again = point_loss(twice, positions.repeat(2, 1, 1), velocities.repeat(2, 1, 1), LossConfig())
    assert float(again.total) == pytest.approx(float(once.total), rel=1e-4)


def test_weights_are_those_of_the_configuration():
    guess, _, positions, velocities = make_prediction()
    config = LossConfig(position_weight=2, velocity_weight=0, variance_weight=0)
    loss = point_loss(guess, positions, velocities, config)
    assert float(loss.total) == pytest.approx(2 * float(loss.terms["position"]))


@pytest.mark.parametrize("with_velocity", [True, False])
def test_a_reconstruction_is_compared_with_what_went_in(with_velocity):
    guess, cloud, _, _ = make_prediction()
    loss = reconstruction_loss(guess, cloud, LossConfig(), with_velocity=with_velocity)
    position = squared_error_by_loops(guess.positions, cloud[..., :3], 0.01)
    velocity = squared_error_by_loops(guess.velocities, cloud[..., 4:], 0.1)
    assert float(loss.total) == pytest.approx(position + velocity * with_velocity, rel=1e-4)


def test_the_object_loss_is_zero_at_the_motion_that_the_target_made():
    torch.manual_seed(0)
    cloud = make_step(3)[0][..., :3]
    before = cloud[:, :512]
    translation, columns = 0.02 * torch.randn(3, 3), torch.tensor([1.0, 0, 0, 0, 1, 0]) + 0.1 * torch.randn(3, 6)
    rotation = matrix_from_6d(columns)
    after = move_rigidly(before, translation, rotation)

    def loss_of(translation, columns):
        guess = ObjectPrediction(positions=cloud, velocities=cloud, translation=translation, rotation_6d=columns)
        return object_loss(guess, before, after, LossConfig())

    exact = rotation[..., :2].mT.flatten(1)
    assert float(loss_of(translation, exact).total) < 1e-4
    off_by_1_cm = loss_of(translation + torch.tensor([0.01, 0, 0]), exact)
    assert float(off_by_1_cm.total) == pytest.approx(1.0, rel=1e-2)
    off_by_a_tenth = loss_of(translation, exact + torch.tensor([0.1, 0, 0, 0, 0, 0]))
    assert float(off_by_a_tenth.terms["rotation"]) == pytest.approx(1.0, rel=1e-2)
