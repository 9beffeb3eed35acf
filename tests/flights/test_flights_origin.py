"""Where a mission lies: about the place of take-off, whatever the local frame's origin is."""

import math

import numpy as np
import pytest

from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures


def desired_at(flown, phase):
    """The reference at the last sample of a phase."""
    rows = [r.values for r in flown.records("control") if r.values["phase"] == phase]
    return rows[-1]["desired_enu_m"]


def test_the_trajectory_is_moved_and_turned_and_scored_in_the_local_frame(bench):
    flown = bench.fly(
        settings={"origin.offset_enu_m": "[0.5, -0.4, 0.3]", "origin.heading_deg": "90"}
    )
    assert flown.outcome.outcome == "landed"
    rows = [r.values for r in flown.records("control")]
    held = next(v["position_enu_m"] for v in rows if v["phase"] == "hold")
    # The short trajectory begins at (0, 0, 2.4) and ends at (0.4, -0.3, 2.5).
    begin = [held[0] + 0.5, held[1] - 0.4, 2.7]
    assert desired_at(flown, "hover") == pytest.approx(begin, abs=0.01)
    moved = np.subtract(desired_at(flown, "track"), desired_at(flown, "hover"))
    assert moved == pytest.approx([0.3, 0.4, 0.1], abs=0.01)
    data = read_flight(flown.folder)
    figures = tracking_figures(data, flown.outcome.scored_s)
    assert figures.against_truth.mean_m < 0.05
    assert figures.as_reported.mean_m == pytest.approx(figures.against_truth.mean_m, abs=0.005)


def shift_local_frame(bench, east_m, north_m, up_m):
    """Let the vehicle report itself elsewhere: its estimator started at another place."""
    import struct

    from companion.mavlink.messages import MessageId
    from tests.flights.wire import AUTOPILOT

    def shift(packet):
        if packet.message_id != MessageId.ODOMETRY or packet.component_id != AUTOPILOT:
            return packet.raw
        payload = bytearray(packet.payload.ljust(232, b"\0"))
        x, y, z = struct.unpack_from("<3f", payload, 8)
        struct.pack_into("<3f", payload, 8, x + north_m, y + east_m, z - up_m)
        return packet.with_payload(bytes(payload))

    bench.wire.from_shim = shift


def test_it_flies_about_the_place_of_take_off_wherever_the_local_frame_began(bench):
    """Far outside of what would be the geofence about the frame's own origin."""
    shift_local_frame(bench, 40.0, -25.0, 7.0)
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.outcome.fallbacks == 0
    end = desired_at(flown, "track")
    assert end == pytest.approx([40.4, -25.3, 9.5], abs=0.1)
    figures = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s)
    assert figures.as_reported.mean_m < 0.05


def test_about_the_local_origin_a_far_vehicle_is_outside_the_geofence(bench):
    shift_local_frame(bench, 40.0, -25.0, 7.0)
    flown = bench.fly(settings={"origin.at": "local"})
    assert not flown.outcome.completed
    assert flown.told("m outside the geofence")


def test_the_vehicles_heading(bench):
    flown = bench.fly(settings={"origin.heading_deg": "vehicle"})
    assert flown.outcome.outcome == "landed"
    hold = [r.values for r in flown.records("control") if r.values["phase"] == "approach"]
    w, x, y, z = hold[0]["attitude_flu_to_enu"]
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    begin = np.array(desired_at(flown, "hover"))
    end = np.array(desired_at(flown, "track"))
    east, north, _ = end - begin
    assert math.atan2(north, east) == pytest.approx(yaw + math.atan2(-0.3, 0.4), abs=0.03)


def test_a_trajectory_that_leaves_the_fence_as_the_vehicle_points_is_not_flown(bench):
    # The shim's vehicle points east, and the trajectory goes 0.7 m ahead.
    fence = {"geofence.low_m": "[-1, -1, 0.2]", "geofence.high_m": "[0.5, 1, 4]"}
    flown = bench.fly(settings={"origin.heading_deg": "vehicle"} | fence)
    assert flown.outcome.outcome == "aborted"
    assert "leaves the geofence at t = " in flown.outcome.note
    assert "The vehicle was landed." in flown.outcome.note
    assert flown.wire.setpoints == []
