"""Vehicles and companions that are ended with the test."""

import pytest

from tests.process_faults.harness import Companion, Vehicle


@pytest.fixture
def begin(tmp_path):
    """Start a vehicle, and a companion that flies it."""
    running = []

    def begin_both(autopilot, *options, parameters=None, speed=2.0, **more):
        low = {"MIS_TAKEOFF_ALT": 1.0} if autopilot == "px4" else {}
        vehicle = Vehicle(autopilot, low | (parameters or {}), speed)
        running.append(vehicle.end)
        companion = Companion(tmp_path, vehicle, *options, **more)
        running.append(companion.clean_up)
        vehicle.booted()
        return vehicle, companion

    yield begin_both
    for end in reversed(running):
        end()
