"""Identification flights in lockstep: what they play, and every way in which they end."""

import asyncio
from dataclasses import dataclass, replace

import numpy as np
import pytest

from companion.experiments.identification_flight import (
    load_identification,
    plan_identification,
)
from companion.flight.embedded_shim import embedded_shim
from companion.flight.experiment import EXPERIMENT_CHANNELS
from companion.flight.inbox import Inbox, PilotCommand
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.mavlink.messages import MessageId
from companion.recording.flight_log import FlightLog
from companion.recording.mcap_log import read_records
from companion.report.identification_log import read_identification
from tests.flights.bench import Seen, assert_setpoints_are_sound
from tests.flights.wire import Wire

ALL = {"hover", "roll", "pitch", "climb", "swing"}


@dataclass
class Identification:
    outcome: object
    folder: object
    wire: Wire
    seen: Seen
    plan: object

    @property
    def recording(self):
        return read_identification(self.folder).recording

    def told(self, text):
        return [said for _, _, said in self.seen.messages if text in said]


def fly(
    folder, *, airborne=True, happenings=(), box_m=2.5, prepare=None, parameters=None, **chosen
):
    overrides = {"vehicle": "bebop2", "autopilot": "px4", "seed": 1} | chosen
    plan = plan_identification(load_identification(None, overrides, {}), box_m=box_m)
    wire, inbox = Wire(), Inbox()
    wire.listen_as(overrides["autopilot"])
    if prepare is not None:
        happenings = prepare(wire, inbox)
    seen = Seen(list(happenings))
    shim = replace(embedded_shim(plan.config), parameters=parameters or {})
    log = FlightLog(folder, (*CHANNELS, *EXPERIMENT_CHANNELS))
    outcome = fly_in_lockstep(
        plan.config,
        plan.trajectory,
        log,
        seen,
        shim,
        inbox=inbox,
        from_shim=wire.tap_from_shim,
        to_shim=wire.tap_to_shim,
        airborne=airborne,
        experiment=plan.experiment,
    )
    log.close()
    assert log.trouble is None
    assert log.lost == 0
    assert_setpoints_are_sound(wire, plan.config.vehicle.tilt_limit_deg)
    return Identification(outcome, folder, wire, seen, plan)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """From the ground to the ground, on PX4, where a camera system tells the place."""
    return fly(tmp_path_factory.mktemp("whole") / "flight", airborne=False)


def test_the_excitation_is_flown_to_its_end_and_the_vehicle_lands(whole):
    assert (whole.outcome.outcome, whole.outcome.completed) == ("landed", True)
    recording = whole.recording
    assert recording.left == ()
    assert whole.told("is not played") == []
    assert set(recording.segment.tolist()) == ALL | {"thrust", "hold"}
    planned = whole.plan.experiment.program
    for name in sorted(ALL | {"thrust"}):
        seconds = sum(p.duration_s for p in planned.parts if p.name == name)
        assert np.count_nonzero(recording.segment == name) == pytest.approx(100 * seconds, abs=4)


def test_it_takes_no_longer_than_it_says(whole):
    begins = {name: time_s for time_s, name in whole.seen.phases}
    assert begins["land"] - begins["take off"] < 75.0


def test_what_is_recorded_is_what_was_sent(whole):
    recording = whole.recording
    sent = np.array([s.thrust for s in whole.wire.setpoints])
    for thrust in recording.thrust[::50]:
        assert np.abs(sent - thrust).min() < 1e-6
    assert 0.0 < np.median(recording.loop_delay_s) < 0.1
    assert np.isfinite(recording.rate_flu_rad_s).all()
    hover = recording.segment == "hover"
    assert np.median(recording.reported_thrust[hover]) == pytest.approx(
        np.median(recording.thrust[hover]), rel=0.01
    )


def test_each_command_is_answered(whole):
    """The recording is of a vehicle that does what it is told: roll follows roll, and so on."""
    from companion.frames import euler_from_quaternion

    recording = whole.recording
    angles = np.array([euler_from_quaternion(tuple(q)) for q in recording.attitude_flu_to_enu])
    for name, asked, answered in (
        ("roll", recording.roll_rad, angles[:, 0]),
        ("pitch", recording.pitch_rad, angles[:, 1]),
        ("climb", recording.climb_rate_m_s, recording.velocity_enu_m_s[:, 2]),
    ):
        rows = recording.segment == name
        assert np.corrcoef(asked[rows][:-20], answered[rows][20:])[0, 1] > 0.8, name


def test_it_stays_in_the_middle_of_its_box(whole):
    recording, box = whole.recording, whole.plan.experiment.box
    offset = recording.position_enu_m - np.median(
        recording.position_enu_m[recording.segment == "hover"], axis=0
    )
    assert np.abs(offset[:, :2]).max() < 0.8 * box.horizontal_m
    assert np.abs(offset[:, 2]).max() < 0.75 * box.vertical_m


def test_the_hold_begins_with_the_thrust_that_the_autopilot_hovers_with(whole):
    """The vehicle's file says 0.5, the autopilot hovers with less."""
    recording = whole.recording
    hover = np.median(recording.thrust[recording.segment == "hover"])
    assert abs(hover - 0.5) > 0.004
    records = read_records(whole.folder / "flight.mcap")
    (facts,) = (record.values for record in records if record.topic == "experiment")
    assert facts["hover_guess"] == pytest.approx(hover, rel=0.03)


def test_over_a_climb_rate_field_the_climb_rate_has_the_thrusts_time_too(tmp_path):
    flown = fly(tmp_path / "flight", autopilot="ardupilot")
    assert (flown.outcome.outcome, flown.outcome.completed) == ("tracked", True)
    recording = flown.recording
    assert recording.thrust_meaning.kind == "climb_rate"
    assert recording.autopilot == "ardupilot"
    assert set(recording.segment.tolist()) == ALL | {"hold"}
    parts = flown.plan.experiment.program.parts
    seconds = sum(p.over_climb_rate.duration_s for p in parts if p.over_climb_rate is not None)
    assert np.count_nonzero(recording.segment == "climb") == pytest.approx(100 * seconds, abs=4)
    # The thrust field is no thrust here: what hovers is what the autopilot reports.
    hover = recording.segment == "hover"
    assert np.median(recording.reported_thrust[hover]) == pytest.approx(0.49, abs=0.03)


def test_outside_the_box_it_lands_by_itself(tmp_path):
    flown = fly(
        tmp_path / "flight", vehicle="sih_quadx", wind="gusts", box_m=1.2, airborne=True, seed=2
    )
    assert (flown.outcome.outcome, flown.outcome.completed) == ("aborted", False)
    assert "left the box of ±1.2 m" in flown.outcome.note
    assert "The vehicle was landed." in flown.outcome.note
    assert [name for _, name in flown.seen.phases][-1] == "land"
    assert "land" in [name for _, name in flown.wire.modes]
    assert flown.wire.armed[-1][1] is False


def test_a_persons_word_lands_it_in_the_midst_of_a_part(tmp_path):
    def prepare(wire, inbox):
        return [("track", 9.0, lambda: inbox.put(PilotCommand.LAND))]

    flown = fly(tmp_path / "flight", prepare=prepare)
    assert (flown.outcome.outcome, flown.outcome.completed) == ("landed", False)
    recording = flown.recording
    assert "roll" in recording.segment.tolist()
    assert "pitch" not in recording.segment.tolist()
    assert flown.wire.armed[-1][1] is False


def test_a_short_loss_of_the_state_costs_the_part_and_no_more(tmp_path):
    """The ladder levels the vehicle meanwhile, as on any flight."""
    lost = (9.0, 9.4)
    began = []

    def prepare(wire, inbox):
        def tamper(packet):
            since = packet.time_s - began[0] if began else -1.0
            is_state = packet.message_id == MessageId.ODOMETRY and packet.component_id == 1
            return b"" if is_state and lost[0] <= since < lost[1] else packet.raw

        wire.from_shim = tamper
        return [("track", 0.0, lambda: began.append(asyncio.get_running_loop().time()))]

    flown = fly(tmp_path / "flight", prepare=prepare)
    assert flown.outcome.completed
    assert flown.outcome.fallbacks > 0
    recording = flown.recording
    planned = {part.name: part.duration_s for part in flown.plan.experiment.program.parts}
    played = {name: np.count_nonzero(recording.segment == name) for name in planned}
    assert played["roll"] < 35.0 * planned["roll"]
    for name in ("pitch", "thrust", "climb", "swing"):
        assert played[name] == pytest.approx(100 * planned[name], abs=4), name
    ((part, why),) = recording.left
    assert part == "roll"
    assert "the hold had to begin anew" in why
    assert flown.told("the part 'roll'") == [why]
    events = (r.values for r in read_records(flown.folder / "flight.mcap") if r.topic == "event")
    assert [e["severity"] for e in events if e["text"] == why] == ["warning"]


def test_thrust_whose_tilt_ardupilot_makes_up_for_is_played_as_thrust(tmp_path):
    parameters = {"GUID_OPTIONS": 8.0}
    flown = fly(tmp_path / "flight", autopilot="ardupilot", parameters=parameters)
    assert flown.outcome.completed
    recording = flown.recording
    assert recording.thrust_meaning.kind == "vertical"
    assert set(recording.segment.tolist()) == ALL | {"thrust", "hold"}
    thrust = recording.segment == "thrust"
    assert np.ptp(recording.velocity_enu_m_s[thrust, 2]) > 0.7


def test_a_take_off_out_of_the_fences_top_is_refused_before_arming(tmp_path):
    parameters = {"MIS_TAKEOFF_ALT": 12.0}
    flown = fly(tmp_path / "flight", airborne=False, parameters=parameters)
    assert flown.outcome.outcome == "refused"
    assert "takes off to 12 m" in flown.outcome.note
    assert "--height 12" in flown.outcome.note
    assert not any(armed for _, armed in flown.wire.armed)
