from math import hypot

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.wind import Moments
from sitl_shim.wind.front import GustFront
from sitl_shim.wind.scenario import Front

HERE = (0.3, -0.2, 1.2)
VELOCITY = (4.8, 3.6, 0.0)


def make(at_s, rise_s, since="boot", moments=None):
    part = Front(kind="front", velocity_enu_m_s=VELOCITY, at_s=at_s, rise_s=rise_s, since=since)
    return GustFront(VELOCITY, part, rise_s, moments or Moments())


def test_it_is_calm_before_half_at_half_the_rise_and_whole_after_it():
    wind = make(2.0, 0.5)
    assert wind.velocity_enu_m_s(2.0, HERE) == (0.0, 0.0, 0.0)
    assert wind.velocity_enu_m_s(2.25, HERE) == pytest.approx((2.4, 1.8, 0.0))
    assert wind.velocity_enu_m_s(2.5, HERE) == VELOCITY
    assert wind.velocity_enu_m_s(99.0, (7.0, 8.0, 9.0)) == VELOCITY


@settings(deadline=None, derandomize=True)
@given(at_s=st.floats(0.0, 30.0), rise_s=st.floats(0.05, 5.0), time_s=st.floats(0.0, 40.0))
def test_it_never_falls_and_its_slope_is_bounded(at_s, rise_s, time_s):
    wind = make(at_s, rise_s)
    now = hypot(*wind.velocity_enu_m_s(time_s, HERE))
    later = hypot(*wind.velocity_enu_m_s(time_s + 0.004, HERE))
    assert -1e-12 <= later - now <= 0.004 * 6.0 * 3.1416 / (2.0 * rise_s) + 1e-9


def test_counted_from_the_setpoints_it_waits_for_them():
    moments = Moments()
    wind = make(1.0, 0.5, "setpoints", moments)
    assert wind.velocity_enu_m_s(100.0, HERE) == (0.0, 0.0, 0.0)
    moments.setpoints_s = 100.0
    assert wind.velocity_enu_m_s(101.0, HERE) == (0.0, 0.0, 0.0)
    assert wind.velocity_enu_m_s(101.5, HERE) == VELOCITY
