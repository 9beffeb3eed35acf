import math
from dataclasses import replace

import numpy as np
import pytest

from sitl_shim.data_file import DataFileError
from sitl_shim.frames import (
    euler_from_quaternion,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
)
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.sensors.estimator import Estimator
from sitl_shim.sensors.profile import load_profile
from sitl_shim.simulation import ShimOptions, Simulation
from sitl_shim.wind.field import CALM

STEP_S = 0.004


@pytest.fixture(scope="module")
def hover():
    """The truth of a hover at (1, 2, 3) m, moving at (0.5, -0.25, 0.125) m/s."""
    plant = Plant(load_vehicle("bebop2"), CALM, seed=1, airborne_at_enu_m=(1.0, 2.0, 3.0))
    return replace(
        plant.state,
        velocity_enu_m_s=(0.5, -0.25, 0.125),
        attitude_flu_to_enu=quaternion_from_euler(0.1, -0.2, 0.7),
        rate_flu_rad_s=(0.3, 0.2, 0.1),
        acceleration_enu_m_s2=(1.0, 2.0, 3.0),
    )


def record(estimator, state, count, step_s=STEP_S):
    return [estimator.update(replace(state, time_s=k * step_s)) for k in range(count)]


def make(profile="mocap", vehicle="bebop2", seed=1, **changes):
    loaded = load_profile(profile).model_copy(update=changes)
    return Estimator(loaded, load_vehicle(vehicle), seed=seed)


def silent(**changes):
    """A motion-capture estimator without any error but those given."""
    quiet = load_profile("mocap")
    attitude = quiet.attitude.model_copy(update={"noise_deg": (0.0,) * 3})
    nothing = {
        "position_noise_m": (0.0,) * 3,
        "velocity_noise_m_s": (0.0,) * 3,
        "rate_noise_rad_s": (0.0,) * 3,
        "acceleration_noise_m_s2": (0.0,) * 3,
        "attitude": attitude,
    }
    return Estimator(quiet.model_copy(update=nothing | changes), load_vehicle("sih_quadx"), seed=1)


def errors_deg(estimate, truth):
    roll, pitch, yaw = (
        a - b
        for a, b in zip(
            euler_from_quaternion(estimate.attitude_flu_to_enu),
            euler_from_quaternion(truth.attitude_flu_to_enu),
            strict=True,
        )
    )
    return [math.degrees(value) for value in (roll, pitch, yaw)]


def test_without_errors_the_estimate_is_the_truth(hover):
    estimate = silent().update(hover)
    assert estimate.time_s == hover.time_s
    assert estimate.position_enu_m == hover.position_enu_m
    assert estimate.velocity_enu_m_s == hover.velocity_enu_m_s
    assert estimate.attitude_flu_to_enu == pytest.approx(hover.attitude_flu_to_enu)
    assert estimate.rate_flu_rad_s == hover.rate_flu_rad_s
    assert estimate.acceleration_enu_m_s2 == hover.acceleration_enu_m_s2


def test_motion_capture_is_good_to_1_mm_and_15_mm_s_white(hover):
    estimates = record(make(), hover, 6000)
    position = np.array([e.position_enu_m for e in estimates]) - hover.position_enu_m
    velocity = np.array([e.velocity_enu_m_s for e in estimates]) - hover.velocity_enu_m_s
    assert position.std(axis=0) == pytest.approx([0.001] * 3, rel=0.04)
    assert velocity.std(axis=0) == pytest.approx([0.015] * 3, rel=0.04)
    for values, size in ((position, 0.001), (velocity, 0.015)):
        assert np.abs(values.mean(axis=0)).max() < 0.06 * size
        neighbours = np.mean(values[:-1] * values[1:], axis=0) / size**2
        assert np.abs(neighbours).max() < 0.05


def test_the_trim_is_a_constant_roll_and_pitch_error_drawn_by_seed(hover):
    level = replace(hover, attitude_flu_to_enu=(1.0, 0.0, 0.0, 0.0))
    trims = []
    for seed in range(150):
        estimates = record(make(seed=seed), level, 40)
        values = np.array([errors_deg(e, level) for e in estimates])
        assert values.std(axis=0) == pytest.approx([0.05] * 3, rel=0.5)
        trims.append(values.mean(axis=0))
    roll, pitch, yaw = np.array(trims).T
    for trim in (roll, pitch):
        assert -0.85 < trim.min() < -0.7
        assert 0.7 < trim.max() < 0.85
        assert trim.std() == pytest.approx(0.8 / math.sqrt(3.0), rel=0.12)
    assert np.abs(yaw).max() < 0.05
    assert abs(np.corrcoef(roll, pitch)[0, 1]) < 0.3


def test_a_trim_turns_with_the_body_and_not_with_the_world(hover):
    quiet = load_profile("mocap").attitude
    tilted = quiet.model_copy(update={"bias_deg": (2.0, -1.0, 0.0), "noise_deg": (0.0,) * 3})
    estimator = silent(attitude=tilted)
    north = replace(hover, attitude_flu_to_enu=quaternion_from_euler(0.0, 0.0, math.pi / 2))
    assert errors_deg(estimator.update(north), north) == pytest.approx([2.0, -1.0, 0.0], abs=0.03)


def test_a_yaw_error_turns_about_the_worlds_vertical(hover):
    quiet = load_profile("mocap").attitude
    turned = quiet.model_copy(update={"bias_deg": (0.0, 0.0, -9.5), "noise_deg": (0.0,) * 3})
    estimate = silent(attitude=turned).update(hover)
    error = quaternion_multiply(
        estimate.attitude_flu_to_enu, quaternion_conjugate(hover.attitude_flu_to_enu)
    )
    assert error == pytest.approx(quaternion_from_euler(0.0, 0.0, math.radians(-9.5)))


def test_one_seed_gives_the_same_estimates_and_another_does_not(hover):
    for profile in ("mocap", "gnss"):
        first = record(make(profile, seed=4), hover, 700)
        assert first == record(make(profile, seed=4), hover, 700)
        assert first != record(make(profile, seed=5), hover, 700)


def test_every_estimate_is_an_attitude(hover):
    for estimate in record(make("gnss"), hover, 500):
        assert math.hypot(*estimate.attitude_flu_to_enu) == pytest.approx(1.0, abs=1e-12)


def test_rates_and_accelerations_have_their_noise_and_the_gyro_its_bias(hover):
    estimator = make(rate_bias_spread_rad_s=(0.02, 0.02, 0.02))
    estimates = record(estimator, hover, 4000)
    rates = np.array([e.rate_flu_rad_s for e in estimates]) - hover.rate_flu_rad_s
    assert rates.std(axis=0) == pytest.approx([0.005] * 3, rel=0.05)
    bias = np.abs(rates.mean(axis=0))
    assert bias.max() < 0.0205
    assert bias.min() > 0.0005
    accelerations = (
        np.array([e.acceleration_enu_m_s2 for e in estimates]) - hover.acceleration_enu_m_s2
    )
    assert accelerations.std(axis=0) == pytest.approx([0.05] * 3, rel=0.05)


def moving(k):
    return (0.1 * k, -0.2 * k, 0.3 * k), (1.0 * k, 2.0 * k, 3.0 * k)


def test_a_delay_makes_position_and_velocity_old_and_nothing_else(hover):
    estimator = silent(pose_delay_s=0.02)
    for k in range(30):
        position, velocity = moving(k)
        state = replace(
            hover,
            time_s=k * STEP_S,
            position_enu_m=position,
            velocity_enu_m_s=velocity,
            rate_flu_rad_s=(float(k), 0.0, 0.0),
        )
        estimate = estimator.update(state)
        old_position, old_velocity = moving(max(0, k - 5))
        assert estimate.position_enu_m == old_position
        assert estimate.velocity_enu_m_s == old_velocity
        assert estimate.rate_flu_rad_s == (float(k), 0.0, 0.0)
        assert estimate.time_s == k * STEP_S


def test_a_rate_holds_position_and_velocity_between_samples(hover):
    estimator = silent(pose_rate_hz=50.0)
    seen = []
    for k in range(26):
        position, velocity = moving(k)
        state = replace(
            hover, time_s=k * STEP_S, position_enu_m=position, velocity_enu_m_s=velocity
        )
        seen.append(estimator.update(state).position_enu_m)
    assert seen == [moving(5 * (k // 5))[0] for k in range(26)]


@pytest.fixture(scope="module")
def gnss_errors(hover):
    """Slow errors of twelve seeds over 100 s: (seed, time, position and velocity and angles)."""
    still = replace(
        hover,
        velocity_enu_m_s=(0.0, 0.0, 0.0),
        attitude_flu_to_enu=quaternion_from_euler(0.0, 0.0, 0.7),
    )
    runs = []
    for seed in range(12):
        estimator = make(
            "gnss",
            "sih_quadx",
            seed,
            position_noise_m=(0.0,) * 3,
            velocity_noise_m_s=(0.0,) * 3,
        )
        runs.append(
            [
                (
                    *(a - b for a, b in zip(e.position_enu_m, (1.0, 2.0, 3.0), strict=True)),
                    *e.velocity_enu_m_s,
                    *errors_deg(e, still),
                )
                for e in record(estimator, still, 5000, step_s=0.02)
            ]
        )
    return np.array(runs)


def test_gnss_velocity_is_off_as_measured_and_slowly(gnss_errors):
    velocity = gnss_errors[:, 500:, 3:6]
    assert velocity.std(axis=(0, 1)) == pytest.approx([0.18, 0.27, 0.18], rel=0.12)
    after_100_ms = np.mean(velocity[:, :-5] * velocity[:, 5:], axis=(0, 1))
    assert (after_100_ms / velocity.var(axis=(0, 1)) > 0.75).all()


def test_gnss_position_error_is_the_integral_of_the_velocity_error(gnss_errors):
    position, velocity = gnss_errors[:, :, 0:3], gnss_errors[:, :, 3:6]
    means = 0.5 * (velocity[:, 1:] + velocity[:, :-1])
    walked = 0.02 * means[:, :4950].reshape(12, 99, 50, 3).sum(axis=2)
    moved = np.diff(position[:, 0:4951:50], axis=1)  # in each second
    # The trapezium rule on a path this rough leaves sqrt(q h^2 T / 12), 3 mm at most, with
    # q = 4 damping velocity^3 / position; the moves themselves are fifty times that.
    assert (walked - moved).std(axis=(0, 1)).max() < 0.004
    assert moved.std(axis=(0, 1)).min() > 0.1


def test_gnss_truth_drifts_from_the_estimate_as_measured(gnss_errors):
    position = gnss_errors[:, 500:, 0:3]
    drift = np.linalg.norm(position[:, 1000:] - position[:, :-1000], axis=2)  # in 20 s
    assert 0.2 < np.median(drift) < 0.7
    floor = np.linalg.norm(position - position.mean(axis=1, keepdims=True), axis=2).mean()
    assert floor == pytest.approx(0.29, rel=0.12)


def test_gnss_starts_at_the_origin_of_its_own_frame(gnss_errors):
    assert gnss_errors[:, 0, 0:6] == pytest.approx(np.zeros((12, 6)), abs=1e-12)


def test_gnss_attitude_is_off_as_measured(gnss_errors):
    angles = gnss_errors[:, :, 6:9]
    assert angles.mean(axis=(0, 1)) == pytest.approx([-0.6, 1.4, -9.5], abs=1.5)
    assert angles.std(axis=(0, 1)) == pytest.approx([1.3, 0.7, 4.0], rel=0.25)
    flat = (angles - angles.mean(axis=1, keepdims=True)).reshape(-1, 3)
    assert np.abs(np.corrcoef(flat.T) - np.eye(3)).max() < 0.6  # each axis by itself
    step = np.abs(np.diff(angles, axis=1)).max()
    assert step < 1.0  # it wanders, it does not jump


def test_on_the_ground_with_rotors_stopped_the_drift_stands_still(hover):
    estimator = make("gnss", "sih_quadx")
    record(estimator, hover, 2500)
    standing = replace(
        hover,
        velocity_enu_m_s=(0.0, 0.0, 0.0),
        rotor_thrust_n=(0.0,) * 4,
        on_ground=True,
    )
    estimates = [estimator.update(replace(standing, time_s=10.0 + k * STEP_S)) for k in range(1000)]
    position = np.array([e.position_enu_m for e in estimates])
    velocity = np.array([e.velocity_enu_m_s for e in estimates])
    assert position.std(axis=0).max() < 0.003
    assert np.abs(velocity.mean(axis=0)).max() < 0.002


def test_exact_sensors_tell_the_truth(hover):
    for vehicle in ("bebop2", "x500", "sih_quadx"):
        for seed in (1, 2):
            estimates = record(make("exact", vehicle, seed), hover, 600)
            for estimate in (estimates[0], estimates[-1]):
                assert estimate.position_enu_m == hover.position_enu_m
                assert estimate.velocity_enu_m_s == hover.velocity_enu_m_s
                assert estimate.rate_flu_rad_s == hover.rate_flu_rad_s
                assert estimate.acceleration_enu_m_s2 == hover.acceleration_enu_m_s2
                assert estimate.attitude_flu_to_enu == pytest.approx(
                    hover.attitude_flu_to_enu, abs=1e-15
                )


def test_other_sensors_than_the_vehicles_own_change_nothing_else():
    own = Simulation(ShimOptions(vehicle="x500", seed=3))
    exact = Simulation(ShimOptions(vehicle="x500", seed=3, sensors="exact"))
    by_name = Simulation(ShimOptions(vehicle="x500", seed=3, sensors="mocap"))
    for simulation in (own, exact, by_name):
        simulation.sense()
    assert exact.estimate.position_enu_m == exact.state.position_enu_m == own.state.position_enu_m
    assert own.estimate.position_enu_m != own.state.position_enu_m
    assert by_name.estimate == own.estimate


def test_an_unknown_sensor_profile_is_refused_with_those_that_there_are():
    with pytest.raises(DataFileError, match="'exat'; known are ekf3, exact, gnss, mocap"):
        Simulation(ShimOptions(sensors="exat"))
