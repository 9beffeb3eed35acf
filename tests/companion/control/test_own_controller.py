"""What the stack around a controller of one's own makes of what it asks for."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.control.frameworks import Limits, Tick
from companion.control.own_controller import (
    AccelerationSetpoint,
    AttitudeSetpoint,
    ControlSample,
    OwnStack,
    Preview,
    Setpoint,
)
from companion.control.thrust import GRAVITY_M_S2, ThrustGains
from companion.control.thrust_laws import ClimbRateField, CollectiveThrust, ThrustLaw
from companion.control.yaw import YawGains
from companion.frames import quaternion_from_euler, rotate, yaw_of
from companion.trajectories.harmonic import TEST_TRAJECTORIES
from companion.vehicle_state import VehicleState

TILT = math.radians(35.0)
HOVER = 0.5
LEVEL = (1.0, 0.0, 0.0, 0.0)
COLLECTIVE = CollectiveThrust(ThrustGains(4.0, 1.0, HOVER, 0.0, 0.08, 0.95, 4.0, 0.003, 0.2))
finite = st.floats(-1e6, 1e6)


@dataclass
class Asks:
    """Asks for the same at each sample, and keeps what it was given."""

    setpoint: Setpoint
    samples: list[ControlSample] = field(default_factory=list)

    def start(self, state: VehicleState) -> None:
        self.samples.clear()

    def step(self, sample: ControlSample) -> Setpoint:
        self.samples.append(sample)
        return self.setpoint


def at(time_s: float, attitude=LEVEL) -> VehicleState:
    return VehicleState(time_s, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0), attitude, (0.0, 0.0, 0.0))


def stack(setpoint: Setpoint, thrust: ThrustLaw = COLLECTIVE) -> OwnStack:
    return OwnStack(Asks(setpoint), thrust, YawGains(1.5, 1.0), Limits(TILT, 1.5, 1.2), 4.0)


def flown(setpoint: Setpoint, thrust: ThrustLaw = COLLECTIVE, attitude=LEVEL):
    own = stack(setpoint, thrust)
    memory = own.start(at(1.0, attitude))
    tick = Tick(at(1.01, attitude), 0.03, 0.0, 2.0)
    _, command, record = own.step(memory, tick, lambda times: np.zeros((len(times), 3)))
    return command, record


def up(command) -> np.ndarray:
    return np.array(rotate(command.attitude_flu_to_enu, (0.0, 0.0, 1.0)))


def test_no_acceleration_hovers_level():
    command, _ = flown(AccelerationSetpoint((0.0, 0.0, 0.0)))
    assert up(command) == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)
    assert command.thrust == pytest.approx(HOVER)


@pytest.mark.parametrize("yaw_rad", [0.0, 1.0, -2.5])
def test_the_thrust_points_along_gravity_and_acceleration_whatever_the_heading(yaw_rad):
    heading = quaternion_from_euler(0.0, 0.0, yaw_rad)
    command, _ = flown(AccelerationSetpoint((2.0, -1.0, 1.5), yaw_rad), attitude=heading)

    wanted = np.array([2.0, -1.0, GRAVITY_M_S2 + 1.5])
    assert up(command) == pytest.approx(wanted / np.linalg.norm(wanted), abs=1e-9)
    assert yaw_of(command.attitude_flu_to_enu) == pytest.approx(yaw_rad, abs=1e-9)


def test_an_attitude_with_a_thrust_is_sent_as_it_is():
    attitude = quaternion_from_euler(0.2, -0.1, 0.0)
    vertical = rotate(attitude, (0.0, 0.0, 1.0))[2]
    command, _ = flown(AttitudeSetpoint(attitude, GRAVITY_M_S2 / vertical))

    assert command.attitude_flu_to_enu == pytest.approx(attitude, abs=1e-9)
    assert command.thrust == pytest.approx(HOVER)  # of a vehicle that is level still


def test_a_quaternion_that_is_not_of_unit_length_means_its_direction():
    twice = tuple(2.0 * c for c in quaternion_from_euler(0.1, 0.0, 0.0))
    command, _ = flown(AttitudeSetpoint(twice, GRAVITY_M_S2))
    assert up(command)[1] == pytest.approx(-math.sin(0.1), abs=1e-9)


@given(st.tuples(finite, finite, finite), st.floats(-100.0, 100.0))
def test_whatever_acceleration_is_asked_for_what_leaves_is_within_the_limits(wanted, yaw_rad):
    command, record = flown(AccelerationSetpoint(wanted, yaw_rad))
    assert math.acos(min(1.0, up(command)[2])) <= TILT + 1e-6
    assert 0.08 <= command.thrust <= 0.95
    assert abs(yaw_of(command.attitude_flu_to_enu)) <= 0.01 + 1e-9  # 1 rad/s for 10 ms
    assert np.hypot(*record.applied_u[:2]) <= math.sin(TILT) + 1e-6


@given(st.tuples(finite, finite, finite, finite), finite)
def test_whatever_attitude_is_asked_for_what_leaves_is_within_the_limits(attitude, thrust):
    if np.linalg.norm(attitude) < 1e-6:
        return
    command, _ = flown(AttitudeSetpoint(attitude, thrust))
    assert math.acos(min(1.0, up(command)[2])) <= TILT + 1e-6
    assert 0.08 <= command.thrust <= 0.95


@pytest.mark.parametrize(
    "setpoint",
    [
        AccelerationSetpoint((math.nan, 0.0, 0.0)),
        AccelerationSetpoint((0.0, 0.0, math.inf)),
        AccelerationSetpoint((0.0, 0.0, 0.0), math.nan),
        AttitudeSetpoint(LEVEL, math.nan),
        AttitudeSetpoint((math.nan, 0.0, 0.0, 0.0), 9.8),
        AttitudeSetpoint((0.0, 0.0, 0.0, 0.0), 9.8),
    ],
)
def test_what_is_not_finite_is_refused(setpoint):
    with pytest.raises(ValueError, match=r"not finite|no direction"):
        flown(setpoint)


def test_what_is_no_setpoint_is_refused():
    with pytest.raises(TypeError, match="AccelerationSetpoint or an AttitudeSetpoint"):
        flown((0.0, 0.0, 0.0))


def test_time_must_advance():
    own = stack(AccelerationSetpoint((0.0, 0.0, 0.0)))
    memory = own.start(at(1.0))
    with pytest.raises(ValueError, match="does not advance"):
        own.step(memory, Tick(at(1.0), 0.03, 0.0), lambda times: np.zeros((len(times), 3)))


def test_over_a_climb_rate_field_an_acceleration_is_a_climb_rate_ahead():
    field_law = ClimbRateField(2.5, 1.5)
    still, _ = flown(AccelerationSetpoint((0.0, 0.0, 0.0)), field_law)
    rising, _ = flown(AccelerationSetpoint((0.0, 0.0, 2.0)), field_law)
    most, _ = flown(AccelerationSetpoint((0.0, 0.0, 1e3)), field_law)
    assert still.thrust == 0.5
    assert rising.thrust == pytest.approx(0.5 + 0.5 * 0.54 / 2.5)
    assert most.thrust == pytest.approx(0.5 + 0.5 * 4.0 * 0.27 / 2.5)


def test_the_state_that_a_controller_is_given_is_a_copy_of_its_own():
    own = stack(AccelerationSetpoint((0.0, 0.0, 0.0)))
    memory = own.start(at(1.0))
    state = at(1.01)
    own.step(memory, Tick(state, 0.03, 0.0), lambda times: np.zeros((len(times), 3)))
    own.controller.samples[0].state.position_enu_m = (9.0, 9.0, 9.0)
    assert state.position_enu_m == (0.0, 0.0, 1.0)


@pytest.mark.parametrize("number", sorted(TEST_TRAJECTORIES))
def test_the_preview_knows_the_derivatives(number):
    trajectory = TEST_TRAJECTORIES[number]
    ahead = np.linspace(0.0, 1.5, 16)
    motion = Preview(trajectory.position, 3.0).motion(ahead)
    exact = trajectory.motion(3.0 + ahead)
    assert np.array_equal(Preview(trajectory.position, 3.0).position(ahead), motion.position_enu_m)
    assert motion.velocity_enu_m_s == pytest.approx(exact.velocity_m_s, abs=1e-4)
    assert motion.acceleration_enu_m_s2 == pytest.approx(exact.acceleration_m_s2, abs=1e-3)
