import json
import math
from dataclasses import replace

import numpy as np
import pytest

from sitl_shim.frames import quaternion_conjugate, quaternion_from_euler, quaternion_multiply
from sitl_shim.plant.quadrotor import Plant
from sitl_shim.plant.vehicle import load_vehicle
from sitl_shim.sensors.camera import CameraOptions, MocapCamera
from sitl_shim.wind.field import CALM


@pytest.fixture(scope="module")
def state():
    plant = Plant(load_vehicle("bebop2"), CALM, seed=1, airborne_at_enu_m=(1.0, 2.0, 3.0))
    attitude = quaternion_from_euler(0.1, -0.2, 0.7)
    return replace(plant.state, attitude_flu_to_enu=attitude)


def look(state, duration_s, **options):
    camera = MocapCamera(CameraOptions(**options), seed=3)
    frames = [camera.look(replace(state, time_s=k * 0.004)) for k in range(round(duration_s * 250))]
    return [frame for frame in frames if frame is not None]


def test_frames_come_at_their_rate_and_leave_after_their_delay(state):
    frames = look(state, 2.0, rate_hz=100.0, delay_s=0.01)
    assert len(frames) == 200
    exposed = json.loads(frames[50].data)["t"] - 1000.0
    assert frames[50].due_s - exposed == pytest.approx(0.01)


def test_a_frame_is_as_documented(state):
    message = json.loads(
        look(state, 0.1, body="b", position_noise_m=0, attitude_noise_deg=0)[0].data
    )
    assert set(message) == {"body", "t", "position", "attitude"}
    assert message["body"] == "b"
    assert message["position"] == pytest.approx([1.0, 2.0, 3.0])
    assert message["attitude"] == pytest.approx(list(state.attitude_flu_to_enu))


def test_the_noise_is_as_large_as_it_is_said_to_be(state):
    frames = [json.loads(f.data) for f in look(state, 20.0)]
    positions = np.array([m["position"] for m in frames])
    assert positions.std(axis=0) == pytest.approx([0.0005] * 3, rel=0.1)
    inverse = quaternion_conjugate(state.attitude_flu_to_enu)
    turns = np.array([quaternion_multiply(inverse, tuple(m["attitude"])) for m in frames])
    assert np.degrees(2.0 * turns[:, 1:]).std(axis=0) == pytest.approx([0.1] * 3, rel=0.1)
    assert max(abs(math.hypot(*m["attitude"]) - 1.0) for m in frames) < 1e-4


def test_the_same_seed_sees_the_same(state):
    assert look(state, 0.5) == look(state, 0.5)
