"""What the study found in a few figures: how the verdicts fell, and the mean errors."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from companion.experiments.paper.results import Claim, PaperResults, Verdict
from companion.experiments.paper.statistics import Spread

VERDICTS: tuple[Verdict, ...] = ("reproduced", "partly", "not reproduced", "not tested")
_OWN = "mpc-l1"


@dataclass(frozen=True, slots=True)
class MeanError:
    """Of one controller over the five trajectories, m; ratios are NaN where flights were lost."""

    controller: str
    calm: Spread
    fan: Spread
    calm_over_mpc_l1: float
    fan_over_mpc_l1: float
    fan_over_calm: float


def verdict_counts(claims: Sequence[Claim]) -> dict[Verdict, int]:
    """How many claims got each verdict, in a fixed order."""
    counted = Counter(claim.verdict for claim in claims)
    return {verdict: counted[verdict] for verdict in VERDICTS}


def mean_errors(results: PaperResults) -> tuple[MeanError, ...]:
    """The controllers' means, MPC-L1 first."""
    errors = results.tracking.errors
    own = errors[_OWN]
    order = [_OWN, *(name for name in errors if name != _OWN)]
    return tuple(
        MeanError(
            name,
            calm=errors[name]["calm"].mean,
            fan=errors[name]["fan"].mean,
            calm_over_mpc_l1=_ratio(errors[name]["calm"].mean, own["calm"].mean),
            fan_over_mpc_l1=_ratio(errors[name]["fan"].mean, own["fan"].mean),
            fan_over_calm=_ratio(errors[name]["fan"].mean, errors[name]["calm"].mean),
        )
        for name in order
    )


def _ratio(above: Spread, below: Spread) -> float:
    known = math.isfinite(above.mean) and math.isfinite(below.mean) and below.mean > 0.0
    return above.mean / below.mean if known else math.nan
