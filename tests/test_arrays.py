import numpy as np
import pytest

from clutter6d.arrays import constant, namespace


def test_a_constant_has_the_type_of_what_it_is_used_with():
    for dtype in (np.float32, np.float64):
        made = constant((1.0, 2.5), np.zeros(3, dtype=dtype))
        assert made.dtype == dtype
        assert made.tolist() == [1.0, 2.5]


def test_a_constant_is_made_once():
    assert constant(((1.0,), (2.0,)), np.zeros(3)) is constant(((1.0,), (2.0,)), np.ones(5))


def test_tensors_have_constants_of_their_own():
    torch = pytest.importorskip("torch")
    made = constant((1.0, 2.5), torch.zeros(3, dtype=torch.float32))
    assert isinstance(made, torch.Tensor)
    assert made.dtype == torch.float32


def test_numbers_that_are_in_no_array_have_no_library():
    with pytest.raises(TypeError):
        namespace([1.0, 2.0])
