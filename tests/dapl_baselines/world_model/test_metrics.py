"""Prediction errors against plain loops and cases with known answers."""

import numpy as np
import pytest
import torch

from clutter6d.eval.metrics import chamfer_distance_m
from dapl_baselines.world_model.metrics import (
    POINT_SETS,
    chamfer_distances,
    floor_positions,
    points_in,
    prediction_errors,
)


def random_clouds(rows: int = 3) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    rng = np.random.default_rng(0)
    now = torch.from_numpy(rng.uniform(-0.2, 0.2, size=(rows, 1280, 3)).astype(np.float32))
    later = now.clone()
    later[:, :300, 0] += 0.01
    later[:, 1024:, 2] += 0.02
    predicted = later + torch.from_numpy(rng.normal(scale=0.002, size=now.shape).astype(np.float32))
    return predicted, now, later


def test_the_chamfer_distance_is_the_evaluations():
    predicted, now, later = random_clouds()
    for name in POINT_SETS:
        chosen = points_in(name, now, later)
        found = chamfer_distances(predicted, later, chosen)
        for row in range(len(predicted)):
            a, b = predicted[row][chosen[row]].numpy(), later[row][chosen[row]].numpy()
            assert float(found[row]) == pytest.approx(chamfer_distance_m(a, b), rel=1e-5)


def test_sets_are_all_the_objects_the_moving_and_both():
    _, now, later = random_clouds(1)
    counts = {name: int(points_in(name, now, later).sum()) for name in POINT_SETS}
    assert counts == {"all": 1280, "objects": 1024, "moving": 300 + 256, "moving_objects": 300}


def test_a_point_is_moving_beyond_two_millimetres():
    now = torch.zeros(1, 1280, 3)
    later = now.clone()
    later[0, 0, 1], later[0, 1, 1] = 0.0019, 0.0021
    assert points_in("moving", now, later)[0, :3].tolist() == [False, True, False]


def test_a_perfect_prediction_has_no_error_and_a_shift_has_its_length():
    _, now, later = random_clouds()
    assert float(prediction_errors(later, now, later)["all"].chamfer_cm.max()) == 0
    shifted = prediction_errors(later + torch.tensor([0.0, 0.0, 0.0003]), now, later)
    for errors in shifted.values():
        torch.testing.assert_close(errors.distance_cm, torch.full((3,), 0.03), rtol=1e-3, atol=0)
        torch.testing.assert_close(errors.chamfer_cm, torch.full((3,), 0.03), rtol=1e-3, atol=0)


def test_clouds_without_moving_points_do_not_count():
    predicted, now, later = random_clouds()
    later[1] = now[1]
    errors = prediction_errors(predicted, now, later)
    assert len(errors["all"].chamfer_cm) == 3
    assert len(errors["moving_objects"].chamfer_cm) == len(errors["moving_objects"].distance_cm) == 2
    nothing = prediction_errors(now, now, now)["moving"]
    assert len(nothing.chamfer_cm) == len(nothing.distance_cm) == 0


def test_floors_copy_or_go_on():
    cloud = torch.zeros(1, 1280, 7)
    cloud[..., 0], cloud[..., 5] = 0.3, 0.2
    floors = floor_positions(cloud)
    assert floors["copy"][0, 0].tolist() == pytest.approx([0.3, 0, 0])
    assert floors["constant_velocity"][0, 0].tolist() == pytest.approx([0.3, 0.02, 0])
