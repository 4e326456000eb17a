"""What every test shares: property tests that repeat exactly, and time limits that suit a busy machine."""

from hypothesis import HealthCheck, settings

settings.register_profile(
    "clutter6d",
    deadline=None,
    derandomize=True,
    max_examples=60,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("clutter6d")
