"""Flights for studies: they begin holding in the air, and end as soon as all is scored."""

import inspect

import numpy as np
import pytest
from typer.testing import CliRunner

from companion.cli import app
from companion.flight.errors import ShimRefusedError
from companion.flight.inbox import PilotCommand
from companion.flight.real_time import fly_in_real_time
from companion.mavlink.commands import CommandId
from companion.mavlink.messages import MessageId
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import Bench
from tests.flights.wire import _HEARTBEAT, AUTOPILOT

SCORED_S = 4.0
TRUTH_ARRIVES_WITHIN_S = 0.05


@pytest.fixture
def another(tmp_path):
    """A second bench, for a second flight."""

    def make(name):
        (tmp_path / name).mkdir()
        return Bench(tmp_path / name)

    return make


def figures(flown):
    return tracking_figures(read_flight(flown.folder), flown.outcome.scored_s)


def phases(flown):
    return [name for _, name in flown.seen.phases]


@pytest.mark.parametrize("vehicle", ["bebop2", "x500", "sih_quadx"])
def test_it_engages_where_it_holds_tracks_and_ends_there(bench, vehicle):
    flown = bench.fly(options={"vehicle": vehicle}, airborne=True)
    assert flown.outcome.outcome == "tracked"
    assert flown.outcome.completed
    assert flown.outcome.note == ""
    assert flown.outcome.fallbacks == flown.outcome.missed_deadlines == 0
    # This trajectory has no run-out: where it ends, the settling begins.
    assert phases(flown) == ["connect", "ready", "engage", "approach", "hover", "track", "settle"]
    asked = [command for _, command, _ in flown.wire.commands]
    assert CommandId.COMPONENT_ARM_DISARM not in asked
    assert CommandId.NAV_TAKEOFF not in asked
    assert [(main, sub) for _, main, sub in flown.wire.mode_requests()] == [(6.0, 0.0)]
    assert [name for _, name in flown.wire.modes] == ["loiter", "offboard"]
    # It never touched the ground, and it is armed still.
    assert [armed for _, armed in flown.wire.armed] == [True]
    start_s, end_s = flown.outcome.scored_s
    assert end_s - start_s == pytest.approx(SCORED_S)
    assert start_s < 5.0
    assert end_s + TRUTH_ARRIVES_WITHIN_S < flown.outcome.flight_s < end_s + 0.4
    truth_s = read_flight(flown.folder).truth.time_s
    assert truth_s[-1] >= end_s


def test_it_begins_at_the_trajectorys_first_point_about_the_missions_origin(bench):
    flown = bench.fly(
        options={"trajectory": 4},
        settings={"origin.offset_enu_m": "[0.5, -0.4, 0.3]", "origin.heading_deg": "-70"},
        airborne=True,
    )
    data = read_flight(flown.folder)
    desired = next(r for r in flown.records("control") if r.values["phase"] == "hover").values
    assert np.abs(data.truth.position_enu_m[0] - desired["desired_enu_m"]).max() < 0.01


def test_the_same_seed_gives_the_same_bytes(bench, another):
    flown = bench.fly(options={"wind": "gusts"}, airborne=True)
    again = another("again").fly(options={"wind": "gusts"}, airborne=True)
    first, second = ((f.folder / "flight.tlog").read_bytes() for f in (flown, again))
    assert first == second
    assert len(first) > 200_000


@pytest.mark.parametrize("vehicle", ["bebop2", "x500", "sih_quadx"])
def test_with_exact_sensors_the_error_is_that_of_a_whole_flight(bench, another, vehicle):
    options = {"vehicle": vehicle}
    settings = {"hover_s": "2"}
    part = bench.fly(options=options, settings=settings, sensors="exact", airborne=True)
    whole = another("whole").fly(options=options, settings=settings, sensors="exact")
    assert whole.outcome.outcome == "landed"
    mean_m = figures(part).against_truth.mean_m
    assert mean_m == pytest.approx(figures(whole).against_truth.mean_m, rel=0.02)
    assert part.outcome.flight_s < 0.4 * whole.outcome.flight_s


def test_exact_sensors_report_the_truth(bench):
    flown = bench.fly(sensors="exact", airborne=True)
    scores = figures(flown)
    # But for the truth's 100 Hz, between which it is interpolated.
    assert scores.as_reported.mean_m == pytest.approx(scores.against_truth.mean_m, rel=1e-3)


def heartbeats(change):
    """A tamper with what the vehicle says of itself."""

    def tamper(packet):
        if packet.message_id != MessageId.HEARTBEAT or packet.component_id != AUTOPILOT:
            return packet.raw
        return packet.with_payload(_HEARTBEAT.pack(*change(*packet.fields(_HEARTBEAT))))

    return tamper


def test_a_vehicle_that_is_not_in_the_air_is_refused(bench):
    bench.wire.from_shim = heartbeats(
        lambda mode, kind, autopilot, base, *rest: (mode, kind, autopilot, base & 0x7F, *rest)
    )
    flown = bench.fly(airborne=True)
    assert flown.outcome.outcome == "refused"
    assert "The vehicle is not armed (mode loiter)" in flown.outcome.note
    assert flown.wire.setpoints == []
    assert flown.wire.commands == []


@pytest.mark.parametrize("phase", ["connect", "ready"])
def test_before_it_takes_over_a_command_refuses_it(bench, phase):
    bench.after(phase, 0.0, lambda: bench.inbox.put(PilotCommand.LAND))
    flown = bench.fly(airborne=True)
    assert flown.outcome.outcome == "refused"
    assert flown.outcome.note == "Stopped by command before taking over."
    assert flown.wire.setpoints == []


def test_a_command_to_land_lands_it(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.LAND))
    flown = bench.fly(airborne=True)
    assert flown.outcome.outcome == "landed"
    assert not flown.outcome.completed
    assert flown.outcome.note == "landed early by command"
    assert flown.wire.armed[-1][1] is False


def test_another_mode_from_outside_is_no_tracked_flight(bench):
    bench.after("track", 1.0, lambda: bench.wire.change_mode("loiter"))
    flown = bench.fly(airborne=True, settings={"timeouts.handed_over_s": "2.0"})
    assert flown.outcome.outcome == "aborted"
    assert not flown.outcome.completed
    assert "somebody else changed the mode to loiter" in flown.outcome.note


def test_the_state_comes_at_250_hz_if_asked_for(bench):
    flown = bench.fly(settings={"state_rate_hz": "250"}, airborne=True)
    assert flown.outcome.outcome == "tracked"
    assert flown.outcome.fallbacks == flown.outcome.missed_deadlines == 0
    times_us = [round(r.values["autopilot_time_s"] * 1e6) for r in flown.records("control")]
    assert set(np.diff(times_us).tolist()) == {4_000}
    sent_s = [setpoint.time_s for setpoint in flown.wire.setpoints]
    assert np.diff(sent_s) == pytest.approx(0.004, abs=1e-6)


def test_the_shipped_step_of_mass_comes_a_quarter_into_what_is_scored(bench):
    flown = bench.fly(
        options={"trajectory": 4, "wind": "mass-step"}, settings={"hover_s": "4"}, airborne=True
    )
    assert flown.outcome.outcome == "tracked"
    assert flown.outcome.flight_s <= 28.0
    start_s, end_s = flown.outcome.scored_s
    controlled = [r.values for r in flown.records("control") if r.values["phase"] == "track"]
    times_s = np.array([values["autopilot_time_s"] for values in controlled])
    thrust = np.array([values["thrust"] for values in controlled])
    step_s = 12.5
    assert (step_s - start_s) / (end_s - start_s) == pytest.approx(0.25, abs=0.02)
    light, heavy = thrust[times_s < step_s], thrust[(times_s > step_s + 3.0) & (times_s < end_s)]
    # It keeps its height in both, on the average.
    assert np.mean(heavy) / np.mean(light) == pytest.approx(1.2, rel=0.02)


def test_no_other_way_of_flying_begins_in_the_air(monkeypatch, tmp_path):
    assert {"airborne", "scope"}.isdisjoint(inspect.signature(fly_in_real_time).parameters)
    asked = []

    def refuse(*_, **options):
        asked.append(options)
        raise ShimRefusedError("enough seen")

    monkeypatch.setattr("companion.lockstep.fly_in_lockstep", refuse)
    result = CliRunner().invoke(app, ["fly", "--lockstep", f"--out={tmp_path / 'flight'}"])
    assert result.exit_code == 2
    assert "enough seen" in result.output
    assert [options.get("airborne", False) for options in asked] == [False]
