import io

import pytest
from PIL import Image

from dapl_baselines.curriculum.picture import draw_curriculum
from tests.dapl_baselines.curriculum.results import make_result


@pytest.mark.parametrize("rates", [(0.0,), (1.0, 1.0), (0.613, 0.65, 0.7, 0.718)])
def test_success_is_drawn_over_rounds(rates):
    results = [make_result(number, rate) for number, rate in enumerate(rates, start=1)]
    assert Image.open(io.BytesIO(draw_curriculum(results))).size == (780, 540)
