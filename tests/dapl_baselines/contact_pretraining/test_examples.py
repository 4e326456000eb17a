import numpy as np
import pytest
import torch
from pydantic import ValidationError

from clutter6d.geometry import quat_to_matrix
from clutter6d.seeding import generator
from clutter6d.sim.end_effector import FINGERS, HAND_BOX
from dapl_baselines.contact_pretraining.examples import ContactShapes, draw_examples
from dapl_baselines.contact_pretraining.settings import ExampleSettings
from tests.dapl_baselines.contact_pretraining.small_contacts import make_boxes

EXACT = ExampleSettings(noise_m=0.0)


def draw(settings: ExampleSettings = EXACT, count: int = 200, seed: int = 0):
    return draw_examples(ContactShapes.of(make_boxes()), settings, count, generator(seed, "examples"))


def hand_frames(hand: torch.Tensor) -> tuple[np.ndarray, np.ndarray]:
    """Positions and rotations of hands, whose first two columns are told."""
    numbers = hand.double().numpy()
    columns = numbers[:, 3:].reshape(-1, 2, 3)
    return numbers[:, :3], np.stack([*columns.swapaxes(0, 1), np.cross(columns[:, 0], columns[:, 1])], axis=-1)


def test_a_patch_is_touched_if_one_of_its_points_lies_in_the_hand():
    found = draw()
    positions, rotations = hand_frames(found.hand)
    for row in range(40):
        local = (found.target[row].double().numpy() - positions[row]) @ rotations[row]
        inside = [
            any(shape.contains(point[None])[0] for shape in (HAND_BOX, *FINGERS))
            or any(abs(np.abs(point - HAND_BOX.centre_m) - HAND_BOX.half_m) < 1e-6)
            for point in local
        ]
        expected = [any(inside[index] for index in patch) for patch in found.patches[row].tolist()]
        assert found.is_touched[row].tolist() == expected


def test_some_patches_are_touched_and_some_are_not():
    found = draw(count=500)
    assert 0.1 < found.is_touched.float().mean() < 0.5
    assert 0.5 < found.is_touched.any(dim=1).float().mean() < 0.9


def test_a_hand_far_from_the_surface_touches_nothing_and_one_in_it_always_something():
    far, near = (ExampleSettings(noise_m=0.0, gap_mean_m=gap, gap_std_m=0.0) for gap in (0.5, -0.02))
    assert not draw(far).is_touched.any()
    assert draw(near).is_touched.any(dim=1).float().mean() > 0.5


def test_objects_have_the_sizes_and_places_asked_for_and_hands_do_not_point_upwards():
    settings = ExampleSettings(noise_m=0.0, radius_m=(0.05, 0.06), place_m=(0.2, 0.0, 0.0))
    found = draw(settings)
    lowest, middles = found.target[..., 2].amin(dim=1), found.target.mean(dim=1)
    assert lowest.abs().max() < 1e-6
    assert found.target.sub(middles[:, None]).norm(dim=-1).amax() < 0.075
    assert (middles[:, 0].abs().max() > 0.15, middles[:, 1].abs().max() < 0.03) == (True, True)
    assert hand_frames(found.hand)[1][:, 2, 2].max() <= 0


def test_errors_are_of_what_is_seen_not_of_what_is_touched():
    exact, noisy = draw(), draw(ExampleSettings(noise_m=0.004))
    difference = noisy.target - exact.target
    assert difference.std().item() == pytest.approx(0.004, rel=0.02)
    torch.testing.assert_close(noisy.hand, exact.hand)


def test_the_seed_decides_everything():
    same, other = draw(seed=0), draw(seed=1)
    assert torch.equal(same.target, draw().target)
    assert torch.equal(same.is_touched, draw().is_touched)
    assert not torch.equal(other.hand, same.hand)


def test_shapes_are_of_size_one_and_stand_as_they_are_stable():
    boxes = make_boxes()
    shapes = ContactShapes.of(boxes)
    np.testing.assert_allclose(np.linalg.norm(shapes.surface, axis=-1).max(axis=-1), 1, rtol=1e-6)
    assert np.isfinite(quat_to_matrix(shapes.orientations)).all()
    for row, box in enumerate(boxes):
        known = {tuple(quat) for quat in box.stable.quats_wxyz}
        assert {tuple(quat) for quat in shapes.orientations[row]} <= known


def test_sizes_are_ordered():
    with pytest.raises(ValidationError, match="the smaller one first"):
        ExampleSettings(radius_m=(0.12, 0.04))
