"""Vehicles and companions that are ended with the test."""

import pytest

from tests.process_faults.harness import Companion, Vehicle

TRIES = 3
"""A busy machine may end a flight before its fault has come; that says nothing of the fault."""


@pytest.fixture
def tracking(tmp_path):
    """Start a vehicle, and a companion that flies it; give both when they track."""
    running = []

    def end_all():
        while running:
            running.pop()()

    def start(autopilot, *options, parameters=None, speed=2.0, trajectory_s=4.0):
        low = {"MIS_TAKEOFF_ALT": 1.0} if autopilot == "px4" else {}
        for number in range(TRIES):
            vehicle = Vehicle(autopilot, low | (parameters or {}), speed)
            running.append(vehicle.end)
            folder = tmp_path / str(number)
            folder.mkdir()
            companion = Companion(folder, vehicle, *options, trajectory_s=trajectory_s)
            running.append(companion.clean_up)
            vehicle.booted()
            if companion.tells("s  track"):
                return vehicle, companion
            said = companion.told()
            end_all()
        raise AssertionError(said)

    yield start
    end_all()
