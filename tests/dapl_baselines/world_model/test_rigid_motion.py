import math

import numpy as np
import torch

from clutter6d.geometry import quat_normalize, quat_to_matrix, rotation_6d
from clutter6d.seeding import generator
from dapl_baselines.world_model.rigid_motion import fit_rigid_motion, matrix_from_6d, move_rigidly


def make_rotations(count: int) -> tuple[torch.Tensor, torch.Tensor]:
    quats = quat_normalize(generator(0, "rotations").normal(size=(count, 4)))
    return tuple(torch.from_numpy(made.astype(np.float32)) for made in (quat_to_matrix(quats), rotation_6d(quats)))


def test_the_6d_form_is_the_one_of_observations():
    matrices, columns = make_rotations(20)
    assert torch.allclose(matrix_from_6d(columns), matrices, atol=1e-6)


def test_any_six_numbers_become_a_rotation():
    torch.manual_seed(0)
    matrices = matrix_from_6d(torch.randn(50, 6))
    assert torch.allclose(matrices @ matrices.mT, torch.eye(3).expand(50, 3, 3), atol=1e-5)
    assert torch.allclose(torch.linalg.det(matrices), torch.ones(50), atol=1e-5)


def test_points_turn_about_their_centroid():
    points = torch.tensor([[[1.0, 0, 0], [3, 0, 0]]])
    quarter = torch.tensor([[[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]])
    moved = move_rigidly(points, torch.tensor([[0.0, 0, 5]]), quarter)
    assert torch.allclose(moved, torch.tensor([[[2.0, -1, 5], [2, 1, 5]]]))


def test_a_rigid_motion_is_found_again_from_the_points():
    torch.manual_seed(0)
    rotations, _ = make_rotations(20)
    points, translations = 0.1 * torch.randn(20, 30, 3) + 1, torch.randn(20, 3)
    translation, rotation = fit_rigid_motion(points, move_rigidly(points, translations, rotations))
    assert torch.allclose(translation, translations, atol=1e-5)
    assert torch.allclose(rotation, rotations, atol=1e-4)


def test_points_in_one_plane_are_not_mirrored():
    torch.manual_seed(0)
    flat = torch.randn(4, 30, 3) * torch.tensor([1.0, 1.0, 0.0])
    angle = torch.tensor(math.pi / 3)
    turn = torch.tensor([[1.0, 0, 0], [0, angle.cos(), -angle.sin()], [0, angle.sin(), angle.cos()]]).expand(4, 3, 3)
    _, rotation = fit_rigid_motion(flat, move_rigidly(flat, torch.zeros(4, 3), turn))
    assert torch.allclose(rotation, turn, atol=1e-4)


def test_points_that_stay_have_not_turned():
    points = torch.rand(2, 512, 3)
    translation, rotation = fit_rigid_motion(points, points)
    assert torch.allclose(translation, torch.zeros(2, 3))
    assert torch.allclose(rotation, torch.eye(3).expand(2, 3, 3), atol=1e-5)
