"""Fields that are read from the payload's bytes are those that pymavlink reads."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as pymavlink

from companion.mavlink.codec import decode
from companion.mavlink.framing import Framer
from companion.mavlink.status_fields import (
    current_mode,
    estimator_flags,
    landed_state,
    sensors,
)

u8, u16, u32 = st.integers(0, 2**8 - 1), st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1)
variances = [st.floats(0.0, 100.0, width=32)] * 8


def frame_of(message, version=2):
    mav = pymavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    (frame,) = Framer().feed(bytes(message.pack(mav, force_mavlink1=version == 1)))
    return frame


@settings(deadline=None, derandomize=True)
@given(st.builds(pymavlink.MAVLink_current_mode_message, u8, u32, u32))
def test_the_mode_is_the_one_that_was_sent(message):
    frame = frame_of(message)

    assert current_mode(frame) == decode(frame).custom_mode


@settings(deadline=None, derandomize=True)
@given(
    st.builds(
        pymavlink.MAVLink_sys_status_message,
        *[u32] * 3, u16, u16, st.integers(-1, 2**15 - 1), st.integers(-1, 100), *[u16] * 6,
    ),
    st.sampled_from((1, 2)),
)  # fmt: skip
def test_sensors_and_battery_are_those_that_were_sent(message, version):
    frame = frame_of(message, version)

    decoded = decode(frame)
    assert sensors(frame) == (
        decoded.onboard_control_sensors_present,
        decoded.onboard_control_sensors_enabled,
        decoded.onboard_control_sensors_health,
        decoded.battery_remaining,
    )


@settings(deadline=None, derandomize=True)
@given(st.builds(pymavlink.MAVLink_extended_sys_state_message, u8, u8))
def test_the_landed_state_is_the_one_that_was_sent(message):
    frame = frame_of(message)

    assert landed_state(frame) == decode(frame).landed_state


@settings(deadline=None, derandomize=True)
@given(
    st.one_of(
        st.builds(
            pymavlink.MAVLink_estimator_status_message, st.integers(0, 2**63), u16, *variances
        ),
        st.builds(pymavlink.MAVLink_ekf_status_report_message, u16, *variances[:6]),
    )
)
def test_the_estimators_flags_are_those_that_were_sent(message):
    frame = frame_of(message)

    assert estimator_flags(frame) == decode(frame).flags


@pytest.mark.parametrize(
    ("message", "read", "expected"),
    [
        (pymavlink.MAVLink_current_mode_message(0, 0, 0), current_mode, 0),
        (pymavlink.MAVLink_extended_sys_state_message(1, 0), landed_state, 0),
        (pymavlink.MAVLink_estimator_status_message(7, 0, *[0.0] * 8), estimator_flags, 0),
        (pymavlink.MAVLink_sys_status_message(*[0] * 13), sensors, (0, 0, 0, 0)),
    ],
)
def test_what_the_sender_has_cut_off_are_zeros(message, read, expected):
    frame = frame_of(message)

    assert len(frame.payload) < 12
    assert read(frame) == expected
