"""Vehicles, and families of them, for the tests of MPC-L1+."""

import numpy as np
from hypothesis import strategies as st

from companion.control.plus.nominal_plant import Actuation, NominalPlant

LIFT = Actuation(60.0, 1.2, 0.002)
CLIMB = Actuation(9.9, 1.02, 0.002, "climb_rate")
THRUSTING = NominalPlant(Actuation(12.0, 0.81, 0.010), LIFT, 0.15)
CLIMBING = NominalPlant(Actuation(12.0, 0.81, 0.010), CLIMB, 0.15)

tilts = st.builds(Actuation, st.floats(5.0, 25.0), st.floats(0.5, 1.3), st.floats(0.0, 0.08))
lifts = st.builds(Actuation, st.floats(10.0, 60.0), st.floats(0.6, 1.3), st.floats(0.0, 0.05))
climbs = st.builds(
    Actuation,
    st.floats(4.0, 15.0),
    st.floats(0.6, 1.3),
    st.floats(0.0, 0.05),
    st.just("climb_rate"),
)
plants = st.builds(NominalPlant, tilts, st.one_of(lifts, climbs), st.floats(0.0, 1.2))


def vectors(most: float, size: int = 3):
    """Arrays (size,) of numbers up to a magnitude."""
    return st.lists(st.floats(-most, most), min_size=size, max_size=size).map(np.array)
