"""The page on the options of environments says what is true: its examples run."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = Path(__file__).resolve().parents[2] / "docs" / "environment-options.md"


@pytest.mark.slow
def test_the_examples_run(capsys):
    names: dict = {}
    for block in re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL):
        exec(compile(block, str(PAGE), "exec"), names)
    capsys.readouterr()
    heavy, plain = names["heavy"].object_masses_kg(), names["model"].object_masses_kg()
    np.testing.assert_allclose(heavy / plain, [1, 100, 1, 0.1])
    assert len(names["target_points"]) > 20
    assert np.abs(names["target_points"][:, :2]).max() < 0.45, "the target lies in the middle of the table"
    for env in ("env", "envs"):
        names[env].close()
