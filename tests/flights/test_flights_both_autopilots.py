"""The same controller on both autopilots, by attitudes and by rates: nearly the same error."""

from functools import cache

import pytest

from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import Bench

COMPARABLE = 1.5
SETTINGS = {"hover_s": "4"}


@pytest.fixture(scope="module")
def fly(tmp_path_factory):
    """Flies options and gives the figures of a flight that has landed as planned; each once."""

    @cache
    def flown(autopilot="auto", setpoint="attitude", vehicle="bebop2", number=4, **others):
        bench = Bench(tmp_path_factory.mktemp("flight"))
        thrust = others.get("guid_options")
        flight = bench.fly(
            options={
                "trajectory": number,
                "autopilot": autopilot,
                "setpoint": setpoint,
                "vehicle": vehicle,
                "wind": others.get("wind", "calm"),
            },
            settings=SETTINGS,
            sensors=others.get("sensors"),
            parameters=None if thrust is None else {"GUID_OPTIONS": thrust},
            check=False,
        )
        assert flight.outcome.outcome == "landed"
        assert flight.outcome.completed
        assert flight.outcome.fallbacks == 0
        return tracking_figures(read_flight(flight.folder), flight.outcome.scored_s)

    return flown


@pytest.mark.parametrize("setpoint", ["attitude", "rates"])
def test_the_figure_eight_on_both(fly, setpoint):
    px4, ardupilot = (
        fly(autopilot=name, setpoint=setpoint).against_truth.mean_m for name in ("px4", "ardupilot")
    )
    assert ardupilot <= COMPARABLE * px4
    assert px4 <= COMPARABLE * ardupilot


def test_with_its_thrust_field_as_thrust_ardupilot_follows_closer_still(fly):
    by_thrust = fly(autopilot="ardupilot", setpoint="attitude", guid_options=8.0)
    by_climb_rate = fly(autopilot="ardupilot", setpoint="attitude")
    assert by_thrust.against_truth.mean_m < by_climb_rate.against_truth.mean_m


def test_ardupilots_own_vehicle_with_its_clean_estimator(fly):
    flown = [fly("ardupilot", vehicle="arducopter", number=n) for n in range(1, 6)]
    assert sum(figures.as_reported.mean_m for figures in flown) / 5 <= 0.06


def test_px4s_own_vehicle_with_motion_capture(fly):
    figures = fly(vehicle="sih_quadx", number=5, sensors="mocap")
    assert figures.against_truth.mean_m <= 0.12


def test_px4s_own_vehicle_on_its_wandering_estimate_in_wind(fly):
    flown = [fly(vehicle="sih_quadx", number=n, wind="wind3") for n in range(1, 6)]
    assert sum(figures.as_reported.mean_m for figures in flown) / 5 <= 0.25
