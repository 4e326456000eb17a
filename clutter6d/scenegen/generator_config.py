"""How scenes are drawn and what counts as valid, in one place."""

from dataclasses import dataclass, field

from clutter6d.scenegen.certificate import CertificateLimits
from clutter6d.scenegen.placement import PlacementConfig
from clutter6d.scenegen.relations import RelationRules
from clutter6d.sim.settle import SettleConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class GeneratorConfig:
    """How scenes are drawn and what counts as valid.

    Attributes:
        max_attempts: Draws of one scene before giving up.
        pose_draws: Target poses drawn for one round of goal pairs.
        rounds: Rounds in which missing goal pairs are drawn again.
        spare_pairs: Pairs settled in a round beyond those missing, since some fail.
        max_target_mass_kg: Heaviest target; the arm pushes it with its hand.
        rules: Thresholds of the relations.
        placement: How hard to search for a placement.
        settle: When objects count as at rest.
        limits: What a valid scene must keep.
    """

    max_attempts: int = 100
    pose_draws: int = 256
    rounds: int = 3
    spare_pairs: int = 2
    max_target_mass_kg: float = 2.0
    rules: RelationRules = field(default_factory=RelationRules)
    placement: PlacementConfig = field(default_factory=PlacementConfig)
    settle: SettleConfig = field(default_factory=SettleConfig)
    limits: CertificateLimits = field(default_factory=CertificateLimits)
