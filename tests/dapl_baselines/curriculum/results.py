"""Results of rounds that were never made."""

from dapl_baselines.curriculum.round_result import RoundResult
from dapl_baselines.validation_run import ValidationResult
from dapl_baselines.world_model.evaluation import MeanErrors


def make_result(number: int, success_rate: float, *, clouds: int = 100) -> RoundResult:
    errors = MeanErrors(clouds=clouds, chamfer_cm=0.4, distance_cm=0.5)
    return RoundResult(
        round=number,
        recorded_steps=60_000 * number,
        errors=dict.fromkeys(("model", "copy", "constant_velocity"), errors),
        validation=ValidationResult(
            episodes=64,
            success_rate=success_rate,
            mean_offset_cm=1.5,
            position_error_m=0.1,
            rotation_error_rad=0.4,
            steps=200.0,
        ),
        world_model_minutes=60.0,
        policy_minutes=90.0,
    )
