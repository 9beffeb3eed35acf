"""A scenario's events in a simulated vehicle: when they come, and how the truth tells them."""

import pytest

from sitl_shim.mavlink.messages_truth import TRUTH_COMPONENT_ID
from sitl_shim.simulation import ShimOptions, Simulation
from tests.sitl_shim.mavlink.shim_client import OFFBOARD, ShimClient

HERE = (0.0, 0.0, 5.0)


def fly(simulation, seconds):
    states = []
    for _ in range(round(seconds / 0.004)):
        simulation.sense()
        simulation.control()
        states.append(simulation.state)
    return states


def scenario(tmp_path, text):
    path = tmp_path / "events.yaml"
    path.write_text(f"name: events\n{text}\n")
    return path


@pytest.mark.parametrize(
    ("autopilot", "vehicle"),
    [("px4", "bebop2"), ("px4", "x500"), ("px4", "sih_quadx"), ("ardupilot", "arducopter")],
)
def test_a_load_that_is_carried_from_the_start_lets_no_airborne_vehicle_sink(autopilot, vehicle):
    options = ShimOptions(
        autopilot=autopilot, vehicle=vehicle, scenario="payload-drop", airborne_at_enu_m=HERE
    )
    simulation = Simulation(options)
    thrust_n = sum(simulation.state.rotor_thrust_n)
    spread = simulation.vehicle.spread.thrust_fraction
    weight_n = 1.15 * simulation.vehicle.mass_kg * 9.80665
    assert thrust_n == pytest.approx(weight_n, rel=spread + 1e-6)
    heights = [state.position_enu_m[2] for state in fly(simulation, 4.0)]
    bare = Simulation(ShimOptions(autopilot=autopilot, vehicle=vehicle, airborne_at_enu_m=HERE))
    calm = [state.position_enu_m[2] for state in fly(bare, 4.0)]
    assert max(abs(a - b) for a, b in zip(heights, calm, strict=True)) < 0.35
    assert not simulation.happened


def client_in_the_air(scenario):
    return ShimClient(
        ShimOptions(vehicle="x500", scenario=scenario, airborne_at_enu_m=HERE, seed=1)
    )


def test_what_counts_from_the_setpoints_comes_that_long_after_they_are_followed(tmp_path):
    path = scenario(
        tmp_path,
        "winds: []\nmotors: [{at_s: 0.4, since: setpoints, rotor: 2, thrust_factor: 0.9}]",
    )
    client = client_in_the_air(path)
    client.start_stream(thrust=0.57)
    client.run(3.0)
    assert not client.simulation.happened, "they are not followed yet"
    client.set_mode(OFFBOARD)
    mode = client.simulation.autopilot
    began_s = client.wait_for(lambda: mode.heartbeat.custom_mode == OFFBOARD, 1.0)
    client.run(0.39)
    assert not client.simulation.happened
    client.run(0.02)
    (event,) = client.simulation.happened
    assert (event.name, event.value) == ("motor2", 0.9)
    assert event.time_s == pytest.approx(began_s + 0.4, abs=0.0041)  # a tick


def test_without_setpoints_it_never_comes(tmp_path):
    path = scenario(
        tmp_path, "winds: []\npayload: [{at_s: 0.0, since: setpoints, mass_share: 0.2}]"
    )
    simulation = Simulation(ShimOptions(scenario=path, airborne_at_enu_m=HERE))
    fly(simulation, 3.0)
    assert not simulation.happened


def test_the_truth_tells_each_event_with_its_time_and_tells_it_again(tmp_path):
    path = scenario(
        tmp_path,
        "winds: [{kind: front, velocity_enu_m_s: [3.0, 4.0, 0.0], rise_s: 0.5, at_s: 1.0}]\n"
        "payload: [{at_s: 0.0, mass_share: 0.1}, {at_s: 2.0, mass_share: 0.0}]",
    )
    client = client_in_the_air(path)
    client.run(1.9)
    assert told(client) == {(1000, "front", 5.0)}
    client.run(2.0)
    assert told(client) == {(1000, "front", 5.0), (2000, "payload", 0.0)}
    again = client.messages("NAMED_VALUE_FLOAT", component=TRUTH_COMPONENT_ID)
    assert len(again) > 10


def test_the_truth_of_a_flight_without_events_tells_none():
    client = client_in_the_air("calm")
    client.run(2.0)
    assert not told(client)


def told(client):
    return {
        (message.time_boot_ms, message.name, message.value)
        for message in client.messages("NAMED_VALUE_FLOAT", component=TRUTH_COMPONENT_ID)
    }
