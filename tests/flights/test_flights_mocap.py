"""Flights on motion capture alone, in lockstep: cameras, bridge, and PX4 without satellites."""

import asyncio
import json
from functools import partial

import pytest

from companion.config.resolve import load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.embedded_shim import embedded_shim
from companion.flight.records import CHANNELS
from companion.lockstep import fly_in_lockstep
from companion.recording.flight_log import FlightLog
from companion.report.aftermath import score_and_draw
from sitl_shim import lockstep as shim_lockstep
from sitl_shim.sensors.camera import CameraOptions
from tests.flights.bench import SHORT, Flown, Seen
from tests.flights.wire import Wire


class Room:
    """Flies a mission by the cameras of a room, which can be tampered with."""

    def __init__(self, folder):
        self.folder = folder
        self.wire = Wire()
        self.happenings = []
        self.truth = []
        self.tamper = lambda data: data
        (folder / "short.csv").write_text(SHORT)

    def after(self, phase, delay_s, tamper):
        """Put something between the cameras and the companion a while after a phase began."""

        def begin():
            self.tamper = tamper

        self.happenings.append((phase, delay_s, begin))

    def see(self, data):
        position_m = tuple(json.loads(data)["position"])
        self.truth.append((asyncio.get_running_loop().time(), position_m))
        return self.tamper(data)

    def true_position_m(self, time_s):
        return next(position for t, position in self.truth if t >= time_s)

    def fly(self, vehicle="sih_quadx", trajectory=None, **settings):
        keys = {"mocap.system": "udp", "hover_s": "0.2"}
        keys |= {f"mocap.{key}": str(value) for key, value in settings.items()}
        trajectory = trajectory or str(self.folder / "short.csv")
        config = load_flight(None, {"trajectory": trajectory, "vehicle": vehicle, "seed": 1}, keys)
        log = FlightLog(self.folder / "flight", CHANNELS)
        seen = Seen(self.happenings)
        outcome = fly_in_lockstep(
            config,
            make_trajectory(config.mission),
            log,
            seen,
            embedded_shim(config),
            from_shim=self.wire.tap_from_shim,
            to_shim=self.wire.tap_to_shim,
            from_cameras=self.see,
        )
        log.close()
        self.result, _ = score_and_draw(config, outcome, self.folder / "flight", 1.0)
        return Flown(outcome, self.folder / "flight", self.wire, seen)


@pytest.fixture
def room(tmp_path):
    return Room(tmp_path)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    room = Room(tmp_path_factory.mktemp("room"))
    return room, room.fly()


def silent(_):
    return b""


def moved_by(x_m):
    def move(data):
        message = json.loads(data)
        message["position"][0] += x_m
        return json.dumps(message).encode()

    return move


class Repeated:
    """A system that says its last pose again and again, with fresh time stamps."""

    def __init__(self):
        self.last = None

    def __call__(self, data):
        message = json.loads(data)
        self.last = self.last or message
        return json.dumps(self.last | {"t": message["t"]}).encode()


def test_without_satellites_it_arms_in_offboard_and_flies_to_its_end(undisturbed):
    room, flown = undisturbed
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.told("armed in mode offboard")
    # The figure that counts is against the truth; a flight this short has seen little of its noise.
    assert room.result["error_against"] == "truth"
    assert room.result["mean_tracking_error_m"] < 0.15


def test_until_it_takes_off_an_armed_vehicle_is_told_to_stand(undisturbed):
    _, flown = undisturbed
    armed_s = next(t for t, armed in flown.wire.armed if armed)
    engaged_s = flown.began("engage")
    on_ground = [s for s in flown.wire.setpoints if s.time_s < engaged_s]
    assert on_ground
    assert all(s.thrust == 0.0 for s in on_ground)
    assert max(s.time_s for s in on_ground) > armed_s
    # From the take-off on nothing streams that could let it fall, until the controller flies.
    assert not [s for s in on_ground if s.time_s > flown.began("take off") + 0.5]


def test_a_vehicle_behind_a_slow_link_flies_by_motion_capture_too(room):
    flown = room.fly(vehicle="bebop2")
    assert flown.outcome.outcome == "landed"
    assert room.result["mean_tracking_error_m"] < 0.15


def test_the_flight_is_refused_while_no_poses_come(room):
    room.tamper = silent
    flown = room.fly()
    assert flown.outcome.outcome == "refused"
    assert "No usable pose of 'drone'" in flown.outcome.note
    assert not flown.was_armed


def test_what_came_instead_is_in_the_refusal(room):
    flown = room.fly(body="chair")
    assert flown.outcome.outcome == "refused"
    assert "of another body" in flown.outcome.note


def test_poses_that_stop_before_arming_refuse_the_flight(room):
    room.after("ready", 4.3, silent)
    flown = room.fly()
    assert flown.outcome.outcome == "refused"
    assert not flown.was_armed


@pytest.mark.parametrize(("phase", "delay_s"), [("take off", 3.0), ("track", 1.0)])
def test_poses_that_stop_in_flight_land_the_vehicle_by_the_autopilot(room, phase, delay_s):
    room.after(phase, delay_s, silent)
    flown = room.fly(timeout_s=0.4)
    assert flown.outcome.outcome == "aborted"
    assert "No usable pose" in flown.outcome.note
    assert "The vehicle was landed" in flown.outcome.note
    (lost_s,) = flown.told("motion capture lost")
    stopped_s = flown.began(phase) + delay_s
    assert 0.35 < lost_s - stopped_s < 0.5
    assert abs(flown.began("land") - lost_s) < 0.1
    # The autopilot's landing, and no setpoint after it.
    assert not [s for s in flown.wire.setpoints if s.time_s > flown.began("land") + 0.5]
    assert flown.wire.armed[-1][1] is False


def test_poses_that_stop_for_a_moment_are_no_fault(room):
    room.after("track", 1.0, silent)
    room.after("track", 1.3, lambda data: data)
    flown = room.fly(timeout_s=0.5)
    assert flown.outcome.outcome == "landed"
    assert not flown.told("motion capture lost")


def test_a_room_that_is_calibrated_anew_before_arming_is_told_and_flown_in(room):
    room.after("connect", 1.0, moved_by(0.5))
    flown = room.fly()
    assert flown.told("the poses jumped")
    assert flown.outcome.outcome == "landed"


@pytest.mark.parametrize(("phase", "delay_s"), [("take off", 3.0), ("hover", 0.1), ("track", 1.0)])
def test_poses_that_jump_in_flight_are_not_flown_by_and_land_the_vehicle(room, phase, delay_s):
    room.after(phase, delay_s, moved_by(2.0))
    flown = room.fly(timeout_s=0.4)
    assert flown.outcome.outcome == "aborted"
    assert "The poses jumped by" in flown.outcome.note
    assert "The vehicle was landed" in flown.outcome.note
    # Once it is disarmed they are believed again, if it comes to that.
    disarmed_s, armed = flown.wire.armed[-1]
    assert not armed
    assert not [t for t in flown.told("the poses jumped; ") if t < disarmed_s]
    jumped_s = flown.began(phase) + delay_s
    assert 0.35 < flown.began("land") - jumped_s < 0.55
    # What the autopilot heard, and so where the vehicle truly was, is what it is when poses stop.
    (room.folder / "again").mkdir()
    again = Room(room.folder / "again")
    again.after(phase, delay_s, silent)
    again.fly(timeout_s=0.4)
    assert room.truth == again.truth
    assert flown.wire.armed[-1][1] is False


def test_false_poses_of_a_few_frames_are_flown_through(room):
    room.after("track", 1.0, moved_by(2.0))
    room.after("track", 1.3, lambda data: data)
    flown = room.fly(timeout_s=0.5)
    assert flown.outcome.outcome == "landed"
    assert room.result["max_tracking_error_m"] < 0.4


def test_a_pose_that_is_repeated_in_flight_lands_the_vehicle(room):
    room.after("track", 1.0, Repeated())
    flown = room.fly(timeout_s=0.4)
    assert flown.outcome.outcome == "aborted"
    assert "the system repeats it" in flown.outcome.note
    repeated_s = flown.began("track") + 1.0
    assert 0.35 < flown.began("land") - repeated_s < 0.55


def test_a_pose_that_is_repeated_from_before_the_take_off_lands_it_soon(room):
    room.after("arm", 0.3, Repeated())
    flown = room.fly(timeout_s=0.4)
    assert flown.outcome.outcome == "aborted"
    assert "the system repeats it" in flown.outcome.note
    assert max(true[2] for _, true in room.truth) < 1.0


def test_cameras_without_noise_are_no_system_that_repeats_itself(room, monkeypatch):
    exact = partial(CameraOptions, position_noise_m=0.0, attitude_noise_deg=0.0)
    monkeypatch.setattr(shim_lockstep, "CameraOptions", exact)
    flown = room.fly()
    assert flown.outcome.outcome == "landed"
    assert not flown.told("motion capture lost")
    # It stood still to the last bit, and that for long enough.
    standing = [true for t, true in room.truth if t < flown.began("arm")]
    assert len(set(standing[-100:])) == 1


def test_a_wrongly_turned_body_leads_the_vehicle_astray(room):
    """Otherwise nothing here would show that frames matter."""
    flown = room.fly(body_yaw_deg=90.0)
    assert flown.outcome.outcome != "landed"


def test_a_room_that_is_turned_as_a_whole_harms_nothing(room):
    flown = room.fly(room_yaw_deg=70.0)
    assert flown.outcome.outcome == "landed"
    # The truth lies elsewhere, of course: in the frame of the simulation, not of the room.
    assert room.result["reported_mean_tracking_error_m"] < 0.15
