"""The ratios that matter, and the limits that were set for them."""

from dataclasses import asdict, dataclass
from typing import Any

TICK = "MPC step + L1 step, DAQP"
OURS = "check, then DAQP (ours)"
FLOOR = "closed form, no check"
SPARSE = "OSQP sparse, three axes jointly"
_ACCURATE_MM = 1.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """A figure beside its limit."""

    what: str
    found: float
    limit: float
    unit: str
    at_most: bool
    holds: bool


def verdicts(std: dict[str, Any], horizons: dict[str, Any]) -> list[dict[str, Any]]:
    """What was set as a limit and can be told from what was run.

    Args:
        std: figures of the set std at N_h 30.
        horizons: figures over horizons.
    """
    runs = std["contenders"]
    found: list[Verdict] = []
    if TICK in runs:
        median, p99 = runs[TICK]["median_us"], runs[TICK]["p99_us"]
        found.append(_at_most("tick (MPC + L1, DAQP): median", median, 60.0, "µs"))
        found.append(_at_most("the same: p99 over median", p99 / median, 5.0, "×"))
        sparse = runs.get(SPARSE)
        if sparse and sparse["worst_error_mm"] <= _ACCURATE_MM:
            ratio = sparse["median_us"] / median
            found.append(_at_least("OSQP sparse over the tick: medians", ratio, 5.0, "×"))
            ratio = sparse["p99_us"] / p99
            found.append(_at_least("OSQP sparse over the tick: p99", ratio, 1.0, "×"))
    if OURS in runs and FLOOR in runs:
        ratio = runs[OURS]["median_us"] / runs[FLOOR]["median_us"]
        found.append(_at_most("check, then DAQP over the closed form: medians", ratio, 3.0, "×"))
    ours = horizons["contenders"].get(OURS)
    if ours:
        for key, told in (("std_median", "median, std"), ("hard_p99", "p99, hard")):
            power = ours[f"exponent_{key}"]
            found.append(_at_most(f"check, then DAQP: exponent in N_h, {told}", power, 1.0, ""))
    return [asdict(verdict) for verdict in found]


def _at_most(what: str, found: float, limit: float, unit: str) -> Verdict:
    return Verdict(what, round(found, 2), limit, unit, at_most=True, holds=found <= limit)


def _at_least(what: str, found: float, limit: float, unit: str) -> Verdict:
    return Verdict(what, round(found, 2), limit, unit, at_most=False, holds=found >= limit)
