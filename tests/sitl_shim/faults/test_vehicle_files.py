"""What a file of faults brings about in a simulation: its parameters, its moments, its mistakes."""

import pytest

from sitl_shim.autopilot.parameters import ParameterError
from sitl_shim.data_file import DataFileError
from sitl_shim.simulation import ShimOptions, Simulation
from tests.sitl_shim.faults.vehicle_flights import copter, options_of, px4_in_offboard, told


def test_its_parameters_are_the_flavours_own_and_yield_to_those_of_the_options():
    text = "{parameters: {px4: {COM_OF_LOSS_T: 2.5, MPC_Z_P: 0.8}, ardupilot: {GUID_TIMEOUT: 0.7}}}"
    px4 = Simulation(ShimOptions(faults=text, parameters={"MPC_Z_P": 0.6})).autopilot.parameters
    assert (px4["COM_OF_LOSS_T"], px4["MPC_Z_P"]) == (2.5, 0.6)
    copter = Simulation(ShimOptions(autopilot="ardupilot", faults=text)).autopilot.parameters
    assert copter["GUID_TIMEOUT"] == pytest.approx(0.7)


@pytest.mark.parametrize("fly", [px4_in_offboard, copter], ids=["px4", "ardupilot"])
def test_what_counts_from_the_setpoints_comes_that_long_after_they_are_followed(fly):
    client = fly({"fault": "battery", "at_s": 0.6, "since": "setpoints", "remaining": 0.9})
    client.run_until(2.5)
    began_s = client.simulation.moments.setpoints_s
    assert 0.5 < began_s <= 1.0
    ((at_s, name, _),) = told(client)
    assert name == "battery"
    assert began_s + 0.599 <= at_s <= began_s + 0.605


def test_the_truth_tells_when_a_fault_of_the_link_begins_but_not_of_what_was_always_so():
    text = (
        "{link: [{loss: 0.1}, {loss: 0.2, from_s: 1.2},"
        " {pause: true, from_s: 0.2, until_s: 0.4, since: setpoints}]}"
    )
    client = px4_in_offboard(faults=text)
    began_s = client.simulation.moments.setpoints_s
    client.run_until(2.2)
    assert sorted(told(client)) == [
        (pytest.approx(min(1.2, began_s + 0.2), abs=2e-3), "link", 3.0 if began_s < 1.0 else 2.0),
        (pytest.approx(max(1.2, began_s + 0.2), abs=2e-3), "link", 2.0 if began_s < 1.0 else 3.0),
    ]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{vehicle: [{fault: explode, at_s: 1.0}]}", "explode"),
        ("{vehicle: [{fault: disarm}]}", "at_s"),
        ("{vehicle: [{fault: battery, at_s: 1.0, remaining: 1.5}]}", "remaining"),
        ("{vehicle: [{fault: frozen_telemetry, at_s: 1.0, lasts_s: 0.0}]}", "lasts_s"),
        ("{vehicle: [{fault: clock_jump, at_s: 1.0, by_s: 1.0e+12}]}", "by_s"),
        ("{vehicle: [{fault: estimator_reset, at_s: 1.0, yaw_deg: .nan}]}", "yaw_deg"),
        ("{vehicle: [{fault: mode, at_s: 1.0, mode: {betaflight: ANGLE}}]}", "betaflight"),
        ("no-such-faults", "bad-link"),
    ],
)
def test_a_mistake_is_refused_and_named(text, says):
    with pytest.raises(DataFileError, match=says):
        Simulation(ShimOptions(faults=text))


def test_a_parameter_that_there_is_not_is_refused():
    with pytest.raises(ParameterError, match="NO_SUCH"):
        Simulation(ShimOptions(faults="{parameters: {px4: {NO_SUCH: 1.0}}}"))


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_without_faults_of_the_vehicle_nothing_is_different(autopilot):
    plain = Simulation(options_of(autopilot, faults=None))
    linked = Simulation(options_of(autopilot, faults="{link: [{loss: 0.5}]}"))
    later = Simulation(options_of(autopilot, {"fault": "reboot", "at_s": 9.0}))
    for _ in range(250):
        for simulation in (plain, linked, later):
            simulation.sense()
            simulation.control()
    assert plain.state == linked.state == later.state
    assert plain.estimate == linked.estimate == later.estimate
    assert plain.stamp_us == later.stamp_us == later.estimate_us == later.elapsed_us
