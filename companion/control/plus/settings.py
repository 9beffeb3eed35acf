"""All of MPC-L1+'s own numbers, but for those of its planner."""

from dataclasses import dataclass

from companion.control.plus.lag import LagSettings
from companion.control.plus.mismatch import MismatchSettings
from companion.control.plus.nominal_plant import NominalPlant
from companion.control.plus.predictor import PredictorNoise


@dataclass(frozen=True, slots=True)
class PlusSettings:
    """MPC-L1+'s own numbers."""

    plant: NominalPlant
    quadratic_drag_1_m: float
    noise: PredictorNoise
    low_pass_rad_s: tuple[float, float, float]
    """Bandwidth ω of C(s), by axis."""
    sigma_bound_m_s2: tuple[float, float, float]
    tilt_rate_limit_rad_s: float
    vertical_limit: tuple[float, float]
    """Least and greatest vertical input: m/s², or m/s over a climb rate."""
    lag: LagSettings | None
    """None: the lag is what was identified."""
    mismatch: MismatchSettings | None
    """None: drag, tilt gain and heading are what was identified."""
    held_sigma: tuple[float, float, float] | None = None
    """Adaptation switched off: σ̂ is this, and nothing is learnt."""
