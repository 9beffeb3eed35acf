"""What the embedded shim is told, in real time."""

import sys
from pathlib import Path

import pytest

from companion.flight import shim_process
from companion.flight.errors import ShimRefusedError
from companion.flight.shim_process import ShimOptions, start_shim, with_state_rate

CALM = Path(__file__).parents[3] / "configs" / "scenarios" / "calm.yaml"
OPTIONS = ShimOptions("px4", "bebop2", CALM, 1)


@pytest.mark.parametrize("rate_hz", [30.0, 100.0, 125.0])
def test_rates_that_the_estimator_has_need_nothing(rate_hz):
    assert with_state_rate(OPTIONS, rate_hz) is OPTIONS


def test_a_higher_rate_sets_the_estimators_period_unless_that_is_given():
    assert with_state_rate(OPTIONS, 250.0).parameters == {"EKF2_PREDICT_US": 4000.0}
    given = ShimOptions("px4", "bebop2", CALM, 1, parameters={"EKF2_PREDICT_US": 8000.0})
    assert with_state_rate(given, 250.0).parameters == {"EKF2_PREDICT_US": 8000.0}


async def test_every_option_goes_onto_the_command_line(monkeypatch):
    asked = []

    class StartedError(Exception):
        pass

    async def start(*arguments, **_):
        asked.extend(arguments)
        raise StartedError

    monkeypatch.setattr(shim_process.asyncio, "create_subprocess_exec", start)
    options = ShimOptions(
        "px4",
        "x500",
        CALM,
        7,
        2.0,
        sensors="exact",
        parameters={"EKF2_PREDICT_US": 4000.0},
        faults="{link: [{loss: 0.1}]}",
    )
    with pytest.raises(StartedError):
        await start_shim(options, 14999)
    assert asked[:4] == [sys.executable, "-m", "sitl_shim", "run"]
    for argument in (
        "--vehicle=x500",
        f"--scenario={CALM}",
        "--seed=7",
        "--speed=2.0",
        "--sensors=exact",
        "--faults={link: [{loss: 0.1}]}",
        "--parameter=EKF2_PREDICT_US=4000.0",
        "--onboard-remote=14999",
    ):
        assert argument in asked
    asked.clear()
    with pytest.raises(StartedError):
        await start_shim(OPTIONS, 14999)
    assert not [a for a in asked if a.startswith(("--sensors", "--faults"))]


async def test_the_shims_own_words_refuse_sensors_that_it_does_not_have():
    options = ShimOptions("px4", "bebop2", CALM, 1, sensors="lidar")
    with pytest.raises(ShimRefusedError, match="no sensor profile called 'lidar'; known are ekf3"):
        await start_shim(options, 14999)


async def test_the_shims_own_words_refuse_faults_that_there_are_not():
    options = ShimOptions("px4", "bebop2", CALM, 1, faults="{link: [{los: 0.1}]}")
    with pytest.raises(ShimRefusedError, match=r"'link.0.los' is unknown; did you mean 'loss'\?"):
        await start_shim(options, 14999)
