"""A recorded flight that is made up: around a circle, 3 cm off, with what a person was told."""

import math

from companion.config.resolve import load_flight
from companion.flight.conduct import Outcome
from companion.flight.configuration_record import configuration_record
from companion.flight.records import CHANNELS
from companion.flight.setpoints.timing import Percentiles
from companion.recording.flight_log import FlightLog
from companion.report.aftermath import score_and_draw
from companion.report.pages.provenance import Provenance
from tests.companion.report.test_report_flight_data import control, odometry, plan, wind

MADE = Provenance("companion fly --traj 2 --wind fan --lockstep", "0.1.0", "abc1234")
STEP_S = 0.02


def config():
    return load_flight(None, {"trajectory": 2, "wind": "fan"}, {})


def outcome(name="landed", *, completed=True, note="", scored_s=(4.0, 10.0), latency=None):
    return Outcome(
        name, completed, note, scored_s, 600, 0, 0, latency, None, 0.0, 12.0, autopilot="px4"
    )


def record(folder, *, end_s=12.0, fallback_s=(0.0, 0.0), messages=()):
    """States from 2 s on; phases hover, track from 4 s on, land from 10 s on."""
    log = FlightLog(folder, CHANNELS)
    log.record("configuration", 0.0, configuration_record(config(), replayable=True))
    phases = [(0.0, "connect: made up"), (2.0, "hover"), (4.0, "track"), (10.0, "land")]
    events = [(t, "info", f"phase {text}") for t, text in phases if t < end_s]
    waiting = sorted([*events, *messages])
    for step in range(round(2.0 / STEP_S), round(end_s / STEP_S)):
        time_s = STEP_S * step
        while waiting and waiting[0][0] <= time_s:
            at_s, severity, text = waiting.pop(0)
            log.record("event", at_s, {"severity": severity, "text": text})
        _tick(log, time_s, fallen=fallback_s[0] <= time_s < fallback_s[1])
    for at_s, severity, text in waiting:
        log.record("event", at_s, {"severity": severity, "text": text})
    log.close()


def _tick(log, time_s, *, fallen):
    east, north = math.cos(time_s), math.sin(time_s)
    phase = "hover" if time_s < 4.0 else "track" if time_s < 10.0 else "land"
    values = control(
        time_s,
        phase=phase,
        desired_enu_m=(east, north, 1.2),
        position_enu_m=(east, north, 1.23),
        u=(0.1 * north, 0.1 * east, 0.0),
        applied_u=(0.1 * north, 0.1 * east, 0.0),
        y_tilde_m_s=(0.01, -0.01, 0.005),
        y_tilde_bound_m_s=(0.02, 0.02, 0.2),
        sigma_bound=(1.0, 1.0, 1.0),
        roll_rad=0.1 * north,
        pitch_rad=0.1 * east,
        thrust=0.5,
        hover_thrust=0.49,
        computed_us=80.0,
        latency_s=0.001,
        loop_delay_s=0.03,
        y_tilde_gauge=0.3,
        controller="mpc-l1",
        monitor="nominal",
        fallback="shifted_plan" if fallen else "",
        reason="no state" if fallen else "",
    )
    log.record("control", time_s, values)
    log.record("plan", time_s, plan(time_s, "closed_form"))
    log.frame_in(time_s, odometry(time_s, (north, east, -1.23)))
    log.frame_in(time_s, wind(time_s, (0.5 if north > 0.8 else 0.0, 0.0, 0.0)))


def fly_page(folder, made=None, **recorded):
    """Write the logs, the result and the page; the page's path, the result, the trouble."""
    record(folder, **recorded)
    result, trouble = score_and_draw(config(), made or outcome(), folder, 1.0, MADE)
    return folder / "report.html", result, trouble


REAL_TIME = Percentiles(0.5, 1.2, 3.0)
