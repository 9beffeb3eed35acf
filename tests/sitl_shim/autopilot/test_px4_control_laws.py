"""Laws of the control cascade: attitude, rates, mixer, position."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.autopilot.filters import SecondOrderLowPass, first_order_gain
from sitl_shim.autopilot.px4.attitude_control import AttitudeControl
from sitl_shim.autopilot.px4.mixer import ThrustCurve, allocate
from sitl_shim.autopilot.px4.parameters import make_parameters
from sitl_shim.autopilot.px4.rate_control import RateControl
from sitl_shim.autopilot.thrust_axis import attitude_from_thrust_axis, heading_of
from sitl_shim.frames import (
    Quaternion,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
)

_law = settings(deadline=None, derandomize=True)
_angle = st.floats(-math.pi, math.pi)
_unit = st.floats(0.0, 1.0)
_torque = st.floats(-1.0, 1.0)


@st.composite
def attitudes(draw: st.DrawFn) -> Quaternion:
    return quaternion_from_euler(draw(_angle), draw(st.floats(-1.5, 1.5)), draw(_angle))


def _turn(attitude: Quaternion, rates: tuple[float, float, float], step_s: float) -> Quaternion:
    half = [0.5 * rate * step_s for rate in rates]
    return quaternion_normalise(quaternion_multiply(attitude, (1.0, half[0], half[1], half[2])))


def _angle_between(a: Quaternion, b: Quaternion) -> float:
    dot = abs(sum(p * q for p, q in zip(a, b, strict=True)))
    return 2.0 * math.acos(min(1.0, dot))


# --- attitude ---


@_law
@given(attitude=attitudes())
def test_at_the_setpoint_no_rate_is_asked_for(attitude: Quaternion) -> None:
    rates = AttitudeControl(make_parameters({})).update(attitude, attitude, 0.0)
    assert rates == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)


@_law
@given(attitude=attitudes(), setpoint=attitudes(), scale=st.sampled_from([-1.0, 0.5, -2.0]))
def test_sign_and_norm_of_the_setpoint_do_not_matter(
    attitude: Quaternion, setpoint: Quaternion, scale: float
) -> None:
    control = AttitudeControl(make_parameters({}))
    w, x, y, z = setpoint
    other = (scale * w, scale * x, scale * y, scale * z)
    expected = control.update(attitude, setpoint, 0.0)
    tilt_error = _angle_between(attitude, setpoint)
    if tilt_error < 3.1:  # at half a turn either way round is as good
        assert control.update(attitude, other, 0.0) == pytest.approx(expected, abs=1e-6)


@_law
@given(attitude=attitudes(), setpoint=attitudes())
def test_rates_stay_within_their_limits_and_lead_to_the_setpoint(
    attitude: Quaternion, setpoint: Quaternion
) -> None:
    control = AttitudeControl(make_parameters({}))
    limits = [math.radians(value) + 1e-9 for value in (220.0, 220.0, 200.0)]
    for _ in range(1500):
        rates = control.update(attitude, setpoint, 0.0)
        assert all(abs(rate) <= limit for rate, limit in zip(rates, limits, strict=True))
        attitude = _turn(attitude, rates, 0.004)
    assert _angle_between(attitude, setpoint) < math.radians(2.0)


def test_tilt_comes_before_yaw() -> None:
    control = AttitudeControl(make_parameters({}))
    setpoint = quaternion_from_euler(0.2, 0.0, 2.5)
    x, y, z = control.update((1.0, 0.0, 0.0, 0.0), setpoint, 0.0)
    tilt_rate = math.hypot(x, y)
    # All of the tilt is asked for at 4 per s, whatever the yaw.
    assert tilt_rate == pytest.approx(4.0 * 2.0 * math.sin(0.1), rel=0.05)
    assert z > 0.5


@_law
@given(attitude=attitudes(), rate=st.floats(-1.0, 1.0))
def test_a_yaw_rate_is_about_the_worlds_vertical(attitude: Quaternion, rate: float) -> None:
    rates = AttitudeControl(make_parameters({})).update(attitude, attitude, rate)
    assert rotate(attitude, rates) == pytest.approx((0.0, 0.0, rate), abs=1e-6)


# --- mixer ---


def _given(thrusts: tuple[float, ...]) -> tuple[float, float, float, float]:
    """Roll, pitch, yaw (FLU, normalised) and thrust that four rotors give."""
    first, second, third, fourth = thrusts  # front right, rear left, front left, rear right
    share = 1.0 / (4.0 * math.sqrt(0.5))
    return (
        (second + third - first - fourth) * share,
        (second + fourth - first - third) * share,
        (third + fourth - first - second) / 4.0,
        (first + second + third + fourth) / 4.0,
    )


@_law
@given(roll=_torque, pitch=_torque, yaw=_torque, thrust=_unit, airmode=st.booleans())
def test_rotors_are_never_told_more_than_they_have(
    roll: float, pitch: float, yaw: float, thrust: float, airmode: bool
) -> None:
    allocation = allocate((roll, pitch, yaw), thrust, airmode=airmode)
    assert all(0.0 <= value <= 1.0 for value in allocation.thrusts)


@_law
@given(
    roll=st.floats(-0.1, 0.1),
    pitch=st.floats(-0.1, 0.1),
    yaw=st.floats(-0.1, 0.1),
    thrust=st.floats(0.3, 0.7),
)
def test_what_fits_is_given_exactly(roll: float, pitch: float, yaw: float, thrust: float) -> None:
    allocation = allocate((roll, pitch, yaw), thrust, airmode=False)
    assert _given(allocation.thrusts) == pytest.approx((roll, pitch, yaw, thrust), abs=1e-12)
    assert allocation.saturated == (0, 0, 0)


@_law
@given(
    roll=st.floats(-0.3, 0.3),
    pitch=st.floats(-0.3, 0.3),
    yaw=_torque,
    thrust=st.floats(0.5, 1.0),
)
def test_at_the_upper_end_yaw_and_then_thrust_give_way_to_roll_and_pitch(
    roll: float, pitch: float, yaw: float, thrust: float
) -> None:
    allocation = allocate((roll, pitch, yaw), thrust, airmode=False)
    given_roll, given_pitch, given_yaw, given_thrust = _given(allocation.thrusts)
    assert (given_roll, given_pitch) == pytest.approx((roll, pitch), abs=1e-9)
    assert abs(given_yaw) <= abs(yaw) + 1e-9
    assert given_thrust <= thrust + 1e-9


def test_without_airmode_thrust_does_not_rise_for_roll() -> None:
    allocation = allocate((0.5, 0.0, 0.0), 0.05, airmode=False)
    assert _given(allocation.thrusts)[3] <= 0.05 + 1e-9
    assert allocation.saturated[0] == 1


def test_with_airmode_thrust_rises_to_keep_roll() -> None:
    roll, _, _, thrust = _given(allocate((0.5, 0.0, 0.0), 0.05, airmode=True).thrusts)
    assert roll == pytest.approx(0.5)
    assert thrust > 0.3


@_law
@given(factor=_unit, thrust=_unit)
def test_the_thrust_curve_inverts_the_rotors(factor: float, thrust: float) -> None:
    curve = ThrustCurve(make_parameters({"THR_MDL_FAC": factor}))
    for signal in curve.signals((thrust, thrust, thrust, thrust)):
        assert factor * signal**2 + (1.0 - factor) * signal == pytest.approx(thrust, abs=1e-6)


# --- rates ---


def test_a_rate_setpoint_of_nan_gives_no_torque_and_spoils_nothing() -> None:
    control = RateControl(make_parameters({}))
    still = {"held": False, "saturated": (0, 0, 0)}
    nan = (math.nan, math.nan, math.nan)
    assert control.update((0.1, 0.0, 0.0), nan, **still) == (0.0, 0.0, 0.0)
    assert all(map(math.isfinite, control.update((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), **still)))


def test_the_integrator_takes_a_constant_error_and_stops_at_its_limit() -> None:
    control = RateControl(make_parameters({}))
    torque = [
        control.update((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), held=False, saturated=(0, 0, 0))[0]
        for _ in range(2000)
    ]
    assert torque[0] == pytest.approx(0.15, rel=0.01)
    assert torque[250] == pytest.approx(0.15 + 0.2, rel=0.05)  # I of 0.2 over a second
    assert torque[-1] == pytest.approx(0.15 + 0.3, rel=0.01)  # MC_RR_INT_LIM


def test_a_saturated_axis_does_not_wind_up() -> None:
    control = RateControl(make_parameters({}))
    for _ in range(500):
        torque = control.update((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), held=False, saturated=(1, 0, 0))[
            0
        ]
    assert torque == pytest.approx(0.15, rel=0.01)


# --- filters ---


def test_the_low_pass_passes_constants_and_halves_the_power_at_its_corner() -> None:
    low_pass = SecondOrderLowPass(250.0, 40.0)
    assert [low_pass.step(3.0) for _ in range(5)] == pytest.approx([3.0] * 5)
    low_pass = SecondOrderLowPass(250.0, 40.0)
    wave = [math.sin(2.0 * math.pi * 40.0 * n / 250.0) for n in range(2500)]
    out = [low_pass.step(value) for value in wave][1000:]
    power = sum(value**2 for value in out) / len(out)
    assert power == pytest.approx(0.25, rel=0.01)


@pytest.mark.parametrize("cutoff_hz", [0.0, 125.0, 1000.0])
def test_a_filter_without_a_useful_corner_is_off(cutoff_hz: float) -> None:
    low_pass = SecondOrderLowPass(250.0, cutoff_hz)
    assert [low_pass.step(value) for value in (1.0, -2.0, 5.0)] == [1.0, -2.0, 5.0]
    assert first_order_gain(250.0, 0.0) == 1.0


# --- position ---


@_law
@given(tilt=st.floats(0.0, 1.3), direction=_angle, yaw=st.floats(-3.14, 3.14))
def test_the_attitude_has_the_thrust_axis_and_the_heading_asked_for(
    tilt: float, direction: float, yaw: float
) -> None:
    axis = (
        math.sin(tilt) * math.cos(direction),
        math.sin(tilt) * math.sin(direction),
        math.cos(tilt),
    )
    attitude = attitude_from_thrust_axis(axis, yaw)
    assert rotate(attitude, (0.0, 0.0, 1.0)) == pytest.approx(axis, abs=1e-9)
    difference = math.remainder(heading_of(attitude) - yaw, 2.0 * math.pi)
    assert difference == pytest.approx(0.0, abs=1e-9)
