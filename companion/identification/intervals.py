"""From a variance to the half-width of a 95 % interval."""

import math

_NORMAL_95 = 1.96


def half_width(variance: float) -> float:
    """Half-width of the 95 % interval of a normally distributed figure.

    Args:
        variance: of it; what rounding made negative counts as 0.
    """
    return _NORMAL_95 * math.sqrt(max(float(variance), 0.0))
