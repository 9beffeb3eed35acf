"""PX4's estimator on poses from outside, flown by PX4 itself: floor, frames, loss."""

import math

import numpy as np
import pytest

from sitl_shim.autopilot.interface import Command
from sitl_shim.mavlink.messages_status import estimator_status
from sitl_shim.sensors.aiding import ExternalPose
from sitl_shim.simulation import ShimOptions, Simulation

NAN = math.nan
INDOORS = {"EKF2_EV_CTRL": 15, "EKF2_GPS_CTRL": 0, "EKF2_HGT_REF": 3}
TAKE_OFF = Command(22, (NAN,) * 7)
ARM = Command(400, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
LOITER = Command(176, (1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0))
PREARM = 0x10000000
MODE_TAKEOFF, MODE_LAND = 0x02040000, 0x06040000


class Room:
    """A vehicle indoors, seen by cameras at 50 Hz."""

    def __init__(self, seed=1, vehicle="sih_quadx", turned_rad=0.0, **parameters):
        self.sim = Simulation(
            ShimOptions(vehicle=vehicle, seed=seed, parameters=INDOORS | parameters)
        )
        self.turned_rad = turned_rad
        self.watching = True
        self.truth, self.estimates = [], []

    def run(self, duration_s):
        sim = self.sim
        self.truth, self.estimates = [], []
        for _ in range(round(duration_s * 250)):
            sim.sense()
            if self.watching and sim.time_us % 20_000 == 0:
                x, y, z = sim.state.position_enu_m
                c, s = math.cos(self.turned_rad), math.sin(self.turned_rad)
                sim.receive_pose(
                    ExternalPose(
                        sim.time_us * 1e-6,
                        (c * x - s * y, s * x + c * y, z),
                        sim.state.attitude_flu_to_enu,
                    )
                )
            sim.control()
            self.truth.append(sim.state.position_enu_m)
            self.estimates.append(sim.estimate.position_enu_m)
        return self

    def take_off(self):
        self.run(5.0)
        self.sim.autopilot.receive_command(TAKE_OFF)
        (ack,) = self.sim.autopilot.receive_command(ARM)
        assert ack.result == 0
        return self.run(15.0)

    @property
    def prearm(self):
        return bool(self.sim.autopilot.sensor_health.health & PREARM)


def test_the_hover_floor_is_that_of_the_real_one():
    """Measured on PX4's own simulation: 0.10 m with motion capture, 0.29 m with satellites."""
    floors = []
    for seed in (1, 2, 3):
        truth = np.array(Room(seed).take_off().run(20.0).truth)
        floors.append(np.linalg.norm(truth - truth.mean(axis=0), axis=1).mean())
    assert 0.05 < np.mean(floors) < 0.16


def test_the_estimate_is_as_good_as_the_poses_and_the_lag_of_a_filter():
    room = Room().take_off().run(10.0)
    errors = np.linalg.norm(np.subtract(room.truth, room.estimates), axis=1)
    assert errors.mean() < 0.05


def test_a_wrongly_turned_pose_leads_the_vehicle_astray():
    room = Room(turned_rad=math.pi / 2).take_off().run(20.0)
    assert math.hypot(*room.truth[-1][:2]) > 3.0


def test_a_slightly_turned_one_is_survived():
    room = Room(turned_rad=math.radians(15.0)).take_off().run(10.0)
    assert math.hypot(*room.truth[-1][:2]) < 1.0


def test_in_hold_it_can_not_be_armed_and_in_take_off_it_can():
    room = Room().run(6.0)
    assert not room.prearm
    (ack,) = room.sim.autopilot.receive_command(ARM)
    assert ack.result == 1
    room.sim.autopilot.receive_command(TAKE_OFF)
    room.run(0.2)
    assert room.prearm


def test_with_neither_satellites_nor_poses_no_mode_that_needs_a_position_can_be_armed_in():
    room = Room()
    room.watching = False
    room.run(6.0)
    room.sim.autopilot.receive_command(TAKE_OFF)
    room.run(0.2)
    assert not room.prearm
    assert not room.sim.estimate.local_position_valid


def test_a_take_off_without_satellites_holds_in_its_mode():
    room = Room().take_off().run(10.0)
    assert room.sim.autopilot.heartbeat.custom_mode == MODE_TAKEOFF
    heights = [position[2] for position in room.truth]
    assert min(heights) > 2.2
    assert max(heights) < 2.8
    (_, ack) = room.sim.autopilot.receive_command(LOITER)
    assert ack.result != 0


def test_when_the_poses_stop_it_goes_on_for_five_seconds_and_then_descends():
    room = Room().take_off()
    room.watching = False
    room.run(4.8)
    assert room.sim.estimate.local_position_valid
    assert room.sim.autopilot.heartbeat.system_status == 4
    room.run(0.5)
    assert not room.sim.estimate.local_position_valid
    assert room.sim.autopilot.heartbeat.custom_mode == MODE_LAND
    assert room.sim.autopilot.heartbeat.system_status == 5
    assert "Failsafe activated" in "".join(t.text for t in room.sim.autopilot.take_texts())
    room.run(12.0)
    assert not room.sim.autopilot.armed
    assert room.truth[-1][2] == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("parameter", [{"EKF2_GPS_CTRL": 7}, {"EKF2_EV_CTRL": 0}])
def test_poses_count_for_nothing_unless_the_parameters_say_so(parameter):
    def estimates(watching):
        sim = Room(**parameter)
        sim.watching = watching
        return sim.run(8.0).estimates

    assert estimates(watching=True) == estimates(watching=False)


def test_the_height_is_the_barometers_unless_poses_are_its_reference():
    def wander(reference):
        room = Room(EKF2_HGT_REF=reference).take_off().run(10.0)
        errors = [t[2] - e[2] for t, e in zip(room.truth, room.estimates, strict=True)]
        return np.std(errors)

    assert wander(3) < 0.02 < wander(0)


def test_parameters_count_from_when_they_are_set():
    room = Room(EKF2_GPS_CTRL=7).run(6.0)
    assert room.prearm
    room.sim.autopilot.parameters.set("EKF2_GPS_CTRL", 0)
    room.run(0.5)
    assert not room.prearm
    assert room.sim.estimate.local_position_valid


def test_what_it_does_not_know_is_missing_in_its_status():
    horizontal_relative, horizontal_absolute = 8, 16
    room = Room().run(6.0)
    flags = estimator_status(room.sim).flags
    assert flags & horizontal_relative
    assert not flags & horizontal_absolute
    room.watching = False
    assert not estimator_status(room.run(6.0).sim).flags & horizontal_relative
    assert estimator_status(Room(EKF2_GPS_CTRL=7).run(1.0).sim).flags & horizontal_absolute
