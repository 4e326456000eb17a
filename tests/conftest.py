"""What every test shares: checked types and shapes, and property tests that repeat exactly."""

from hypothesis import HealthCheck, settings
from jaxtyping import install_import_hook

# As in Python's type system, an int is good where a float is wanted.
install_import_hook(
    ("clutter6d", "dapl_baselines", "leaderboard"),
    "beartype.beartype(conf=beartype.BeartypeConf(is_pep484_tower=True))",
)

settings.register_profile(
    "clutter6d",
    deadline=None,
    derandomize=True,
    max_examples=60,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("clutter6d")
