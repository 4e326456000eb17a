import numpy as np

from dapl_baselines.push_policy import push as columns
from dapl_baselines.push_policy.choice import TRIES, choose


def numbered(rows: int, pushes: int) -> np.ndarray:
    """Pushes that can be told apart by their lengths."""
    drawn = np.zeros((rows, pushes, columns.SIZE))
    drawn[..., columns.LENGTH] = np.arange(pushes)
    return drawn


def test_the_best_push_that_can_begin_is_chosen():
    values = np.array([[0.1, 0.9, 0.5], [0.9, 0.1, 0.5], [0.2, 0.3, 0.1]], dtype=np.float32)
    allowed = np.array([[True, False, True], [True, True, True], [False, False, True]])

    def may_begin(pushes: np.ndarray) -> np.ndarray:
        return allowed[np.arange(3), pushes[:, columns.LENGTH].astype(int)]

    before = values.copy()
    assert choose(values, numbered(3, 3), may_begin).tolist() == [2, 0, 2]
    assert np.array_equal(values, before)


def test_it_asks_of_a_few_alone_and_takes_one_of_these_if_none_can_begin():
    asked = []

    def may_begin(pushes: np.ndarray) -> np.ndarray:
        asked.append(int(pushes[0, columns.LENGTH]))
        return np.zeros(1, dtype=bool)

    values = np.linspace(1, 0, 100, dtype=np.float32)[None]
    (chosen,) = choose(values, numbered(1, 100), may_begin)
    assert asked == list(range(TRIES - 1))
    assert chosen == TRIES - 1
    assert choose(values[:, :2], numbered(1, 2), may_begin).tolist() == [1]
