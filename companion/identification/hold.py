"""What bounds the hold of an identification flight; its gains are `configs/identify/hold.yaml`."""

_LONGEST_WAY_M = 0.8
"""An error counts as no larger: a speed of about 0.4 m/s on the way back."""


def within_reach(reference_m: float, position_m: float) -> float:
    """A reference no further from the vehicle than the hold's errors go, m."""
    error = reference_m - position_m
    return position_m + max(-_LONGEST_WAY_M, min(_LONGEST_WAY_M, error))
