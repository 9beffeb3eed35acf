"""Body rates as setpoints: the companion's own attitude loop flies as well as the autopilot's."""

import math

import pytest

from companion.config.resolve import load_flight
from companion.mavlink.messages import MessageId
from companion.report.flight_data import read_flight
from companion.report.metrics import tracking_figures
from tests.flights.bench import STATE_AGE_LIMIT_S, Bench

RATES_MASK = 128
STATE = {MessageId.ODOMETRY}


def mean_error_m(flown):
    figures = tracking_figures(read_flight(flown.folder), flown.outcome.scored_s)
    return figures.as_reported.mean_m


def assert_rates_are_sound(flown, vehicle):
    assert flown.wire.setpoints
    for s in flown.wire.setpoints:
        assert s.mask == RATES_MASK
        assert all(math.isfinite(rate) for rate in s.rates)
        assert math.hypot(*s.rates[:2]) <= vehicle.attitude_loop.tilt_rate_limit_rad_s + 1e-3
        assert abs(s.rates[2]) <= vehicle.attitude_loop.yaw_rate_limit_rad_s + 1e-3
        assert 0.0 <= s.thrust <= 1.0


@pytest.mark.parametrize("vehicle", ["bebop2", "sih_quadx"])
def test_the_error_is_that_of_attitude_setpoints(bench, tmp_path_factory, vehicle):
    options = {"trajectory": 4, "vehicle": vehicle}
    settings = {"hover_s": "3"}
    by_rates = bench.fly(options=options | {"setpoint": "rates"}, settings=settings, check=False)
    by_attitude = Bench(tmp_path_factory.mktemp("attitude")).fly(options=options, settings=settings)
    for flown in (by_rates, by_attitude):
        assert flown.outcome.outcome == "landed"
        assert flown.outcome.completed
        assert flown.outcome.fallbacks == flown.outcome.missed_deadlines == 0
    assert mean_error_m(by_rates) <= 1.5 * mean_error_m(by_attitude)
    assert_rates_are_sound(by_rates, load_flight(None, options, {}).vehicle)


def test_what_was_sent_is_recorded(bench):
    flown = bench.fly(options={"setpoint": "rates"}, check=False)
    tracked = [r.values for r in flown.records("control") if r.values["phase"] == "track"]
    assert tracked
    sent = {s.rates for s in flown.wire.setpoints}
    for values in tracked[::20]:
        x, y, z = values["rate_setpoint_flu_rad_s"]
        frd = (x, -y, -z)
        assert min(math.dist(frd, rates) for rates in sent) < 1e-6
        assert all(math.isfinite(c) for c in values["attitude_setpoint_flu_to_enu"])


def test_in_silence_the_vehicle_levels_and_is_handed_over(bench):
    begun = []
    bench.after("track", 1.5, lambda: (begun.append(1), bench.wire.cut(None, STATE)))
    flown = bench.fly(options={"setpoint": "rates"}, check=False)
    (over,) = flown.told("handing over: no usable state")
    silent = [s for s in flown.wire.setpoints if s.state_age_s > STATE_AGE_LIMIT_S + 0.02]
    assert len(silent) > 20
    late = [s for s in silent if s.time_s > over - 0.15]
    assert late
    # It has been levelled by reckoning, and does not turn any more.
    assert all(math.hypot(*s.rates) < 0.05 for s in late)
    tilts = [r.values for r in flown.records("control") if r.values["phase"] == "silence"]
    assert tilts
    assert flown.wire.setpoints_after(over) == []
