"""Handing over without a bump: the fade between two commands, and an adaptation held."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.config.resolve import load_flight
from companion.control import handover, l1_adaptive
from companion.control.frameworks import Command, StackRecord
from companion.control.inner import L1Controller, PidController, y_tilde_bounds_m_s
from companion.control.interfaces import AdaptationMean, InnerRecord
from companion.control.pid import PidGains
from companion.control.thrust import GRAVITY_M_S2
from companion.control.transfer_function import TransferFunction
from companion.flight.assemble import l1_gains
from companion.frames import euler_from_quaternion, quaternion_from_euler

ANGLE = st.floats(-0.5, 0.5)
GAINS = l1_gains(load_flight(None, {}, {}).controller.l1)


def command(roll=0.0, pitch=0.0, yaw=0.0, thrust=0.5):
    return Command(quaternion_from_euler(roll, pitch, yaw), thrust)


def angles(result):
    return euler_from_quaternion(result[0].attitude_flu_to_enu)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(ANGLE, ANGLE, ANGLE, ANGLE, st.floats(-3.1, 3.1), st.floats(0.1, 0.9))
def test_it_begins_with_the_old_command_and_ends_with_the_new(r0, p0, r1, p1, yaw, thrust):
    old, new = command(r0, p0, yaw, thrust), command(r1, p1, yaw + 0.3, 0.4)
    fade = handover.fade_from(old, 10.0, 0.3)
    begin = handover.faded(fade, new, 10.0)
    assert angles(begin) == pytest.approx(euler_from_quaternion(old.attitude_flu_to_enu), abs=1e-9)
    assert begin[0].thrust == pytest.approx(old.thrust)
    end = handover.faded(fade, new, 10.3)
    assert angles(end) == pytest.approx(euler_from_quaternion(new.attitude_flu_to_enu), abs=1e-9)
    assert end[0].thrust == pytest.approx(new.thrust)
    assert not fade.over(10.29)
    assert fade.over(10.3)


@settings(deadline=None, derandomize=True, max_examples=50)
@given(ANGLE, ANGLE, ANGLE, ANGLE, st.floats(0.0, 0.4))
def test_in_between_it_keeps_every_limit_that_both_keep(r0, p0, r1, p1, passed_s):
    fade = handover.fade_from(command(r0, p0, 0.0, 0.3), 0.0, 0.3)
    sent, roll, pitch = handover.faded(fade, command(r1, p1, 0.0, 0.6), passed_s)
    length = math.hypot(math.sin(roll), math.sin(pitch))
    limits = [math.hypot(math.sin(r), math.sin(p)) for r, p in ((r0, p0), (r1, p1))]
    assert length <= max(limits) + 1e-9
    assert 0.3 <= sent.thrust <= 0.6
    assert (roll, pitch) == pytest.approx(angles((sent,))[:2])


def test_the_heading_fades_the_short_way_around():
    fade = handover.fade_from(command(yaw=3.1), 0.0, 0.3)
    middle = angles(handover.faded(fade, command(yaw=-3.1), 0.15))[2]
    assert abs(math.remainder(middle - math.pi, 2.0 * math.pi)) < 1e-6


def record(u=(0.1, -0.2, 0.3), sigma=(1.0, 2.0, 3.0)):
    inner = InnerRecord(np.array(u), np.zeros(3), np.zeros(3), np.array(sigma))
    return StackRecord(np.zeros(3), inner, np.array(u), 0.0, 0.0, 0.5, None)


def test_what_was_commanded_is_handed_on_and_a_climb_only_among_equals():
    sent = command(math.radians(5.0), math.radians(-3.0), 0.0)
    u = handover.applied_u(sent, record(), same_kind=True)
    assert u == pytest.approx([math.sin(math.radians(-3.0)), -math.sin(math.radians(5.0)), 0.3])
    assert math.isnan(handover.applied_u(sent, record(), same_kind=False)[2])


def test_the_mean_of_an_adaptation_is_plain_at_first_and_forgets_later():
    mean = None
    for k in range(101):
        mean = handover.mean_step(mean, record(sigma=(k % 2, 1.0, 0.0)), (0.0, 0.0, 0.0), 0.01)
    assert mean.sigma_hat == pytest.approx((0.5, 1.0, 0.0), abs=0.3)
    for _ in range(1000):
        mean = handover.mean_step(mean, record(sigma=(3.0, 1.0, 0.0)), (0.0, 0.0, 0.0), 0.01)
    assert mean.sigma_hat[0] == pytest.approx(3.0, abs=0.02)


def test_a_controller_without_an_adaptation_leaves_no_mean():
    nothing = (math.nan,) * 3
    assert handover.mean_step(None, record(sigma=nothing), (0.0, 0.0, 0.0), 0.01) is None
    law = PidController(PidGains((1.0,) * 3, (0.0,) * 3, (0.0,) * 3, (1.0,) * 3))
    assert law.held(AdaptationMean((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)) is None


def velocity_under(controller, *, disturbance_m_s2, wanted_m_s, seconds=30.0):
    """Horizontal velocity of a plain vehicle ẏ1 = g u + d under the inner law alone."""
    dt, velocity = 0.01, np.zeros(3)
    memory, _ = controller.start(np.zeros(3), velocity, np.zeros(3))
    r2 = np.array([wanted_m_s, 0.0, 0.0]) / np.array(controller.gains.gain_k)
    for _ in range(round(seconds / dt)):
        memory, inner = controller.step(memory, r2, np.zeros(3), velocity, dt)
        memory = controller.with_applied(memory, inner.u)
        push = GRAVITY_M_S2 * inner.u[0] + disturbance_m_s2
        velocity = velocity + np.array([push * dt, 0.0, 0.0])
    return float(velocity[0])


def test_switched_off_the_law_still_damps_and_holds_the_disturbance_that_it_knew():
    trim = -0.3 / GRAVITY_M_S2
    m = GAINS.reference_model[0].denominator[1]
    # At rest under the disturbance: u = trim, and σ̂ = y1 - u.
    mean = AdaptationMean((trim, 0.0, 0.0), (-trim, 0.0, 0.0), (0.0, 0.0, 0.0))
    held = L1Controller(GAINS).held(mean)
    known = velocity_under(held, disturbance_m_s2=0.3, wanted_m_s=0.5)
    assert known == pytest.approx(0.5, abs=0.01)
    # Another one is met by no adaptation: an error of d/m remains.
    other = velocity_under(held, disturbance_m_s2=0.5, wanted_m_s=0.5)
    assert other == pytest.approx(0.5 + 0.2 / m, abs=0.02)


def test_a_reference_model_of_higher_order_cannot_do_without_adaptation():
    second = TransferFunction((2.0, 2.0), (1.0, 3.0, 2.0))
    gains = l1_adaptive.L1Gains(
        (second, second, second),
        GAINS.low_pass,
        GAINS.gain_k,
        GAINS.gamma,
        GAINS.sigma_bound,
    )
    mean = AdaptationMean((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)
    assert L1Controller(gains).held(mean) is None


def test_the_bound_of_y_tilde_falls_with_gamma_down_to_the_noise():
    def bounds(factor, noise):
        gains = l1_adaptive.L1Gains(
            GAINS.reference_model,
            GAINS.low_pass,
            GAINS.gain_k,
            tuple(factor * value for value in GAINS.gamma),
            GAINS.sigma_bound,
        )
        return y_tilde_bounds_m_s(gains, 4.2, (3.0, 3.0, 1.5), (noise,) * 3)

    assert np.array(bounds(2.0, 0.0)) == pytest.approx(0.5 * np.array(bounds(1.0, 0.0)))
    assert bounds(1e6, 0.02)[0] == pytest.approx(0.12, abs=1e-3)
