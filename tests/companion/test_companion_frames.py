"""Frames: laws, and cases worked by hand that a wrong sign can't pass."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion import frames

LAW = settings(deadline=None, derandomize=True, max_examples=60)
angles = st.floats(-math.pi, math.pi)
pitches = st.floats(-1.5, 1.5)
attitudes = st.builds(frames.quaternion_from_euler, angles, pitches, angles)
vectors = st.tuples(*[st.floats(-10, 10)] * 3)
D = math.degrees
R = math.radians


def close(a, b):
    assert a == pytest.approx(b, abs=1e-9)


def same_rotation(a, b):
    assert abs(sum(x * y for x, y in zip(a, b, strict=True))) == pytest.approx(1.0, abs=1e-9)


def matrix_rotation(roll, pitch, yaw, vector):
    """Rz(yaw) Ry(pitch) Rx(roll) v, one axis after the other."""
    x, y, z = vector
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    x, z = math.cos(pitch) * x + math.sin(pitch) * z, -math.sin(pitch) * x + math.cos(pitch) * z
    return math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y, z


@LAW
@given(attitudes)
def test_wire_and_inside_are_a_round_trip(q):
    same_rotation(frames.attitude_from_wire(frames.attitude_to_wire(q)), q)
    same_rotation(frames.attitude_to_wire(frames.attitude_from_wire(q)), q)


@LAW
@given(attitudes, vectors)
def test_an_attitude_on_the_wire_points_vectors_the_same_way(q, vector_flu):
    through_enu = frames.swap_enu_ned(frames.rotate(q, vector_flu))
    close(frames.rotate(frames.attitude_to_wire(q), frames.swap_flu_frd(vector_flu)), through_enu)


@LAW
@given(vectors)
def test_swaps_are_their_own_inverses_and_keep_lengths(vector):
    for swap in (frames.swap_enu_ned, frames.swap_flu_frd):
        assert swap(swap(vector)) == vector
        assert math.hypot(*swap(vector)) == pytest.approx(math.hypot(*vector))


@LAW
@given(attitudes, attitudes, vectors)
def test_rotating_by_a_product_is_rotating_twice(a, b, vector):
    close(
        frames.rotate(frames.quaternion_multiply(a, b), vector),
        frames.rotate(a, frames.rotate(b, vector)),
    )


@LAW
@given(attitudes, attitudes, attitudes)
def test_products_associate_and_the_conjugate_is_the_inverse(a, b, c):
    multiply = frames.quaternion_multiply
    close(multiply(multiply(a, b), c), multiply(a, multiply(b, c)))
    close(multiply(a, frames.quaternion_conjugate(a)), (1, 0, 0, 0))


@LAW
@given(angles, pitches, angles, vectors)
def test_euler_angles_are_yaw_then_pitch_then_roll(roll, pitch, yaw, vector):
    q = frames.quaternion_from_euler(roll, pitch, yaw)
    close(frames.rotate(q, vector), matrix_rotation(roll, pitch, yaw, vector))


@LAW
@given(st.floats(-3.1, 3.1), pitches, st.floats(-3.1, 3.1))
def test_euler_angles_come_back(roll, pitch, yaw):
    q = frames.quaternion_from_euler(roll, pitch, yaw)
    close(frames.euler_from_quaternion(q), (roll, pitch, yaw))
    close(frames.yaw_of(q), yaw)


@LAW
@given(attitudes)
def test_tilt_is_between_the_two_vertical_axes(q):
    assert frames.tilt_cosine(q) == pytest.approx(frames.rotate(q, (0, 0, 1))[2], abs=1e-9)


@LAW
@given(st.floats(-50, 50))
def test_a_wrapped_angle_is_the_same_direction(angle):
    wrapped = frames.wrap_angle_rad(angle)
    assert -math.pi <= wrapped < math.pi
    close((math.cos(wrapped), math.sin(wrapped)), (math.cos(angle), math.sin(angle)))


def test_half_a_turn_wraps_to_the_lower_end():
    assert frames.wrap_angle_rad(math.pi) == -math.pi
    assert frames.wrap_angle_rad(-math.pi) == -math.pi


@pytest.mark.parametrize(
    ("enu", "ned"), [((1, 0, 0), (0, 1, 0)), ((0, 1, 0), (1, 0, 0)), ((1, 2, 3), (2, 1, -3))]
)
def test_east_north_up_is_north_east_down(enu, ned):
    assert frames.swap_enu_ned(enu) == ned


def test_forward_left_up_is_forward_right_down():
    assert frames.swap_flu_frd((1, 2, 3)) == (1, -2, -3)


@pytest.mark.parametrize(
    ("yaw_ned_deg", "yaw_enu_deg"), [(0, 90), (90, 0), (30, 60), (-90, 180), (135, -45)]
)
def test_a_compass_heading_is_counted_from_north_clockwise(yaw_ned_deg, yaw_enu_deg):
    inside = frames.attitude_from_wire(frames.quaternion_from_euler(0, 0, R(yaw_ned_deg)))
    off = frames.wrap_angle_rad(frames.yaw_of(inside) - R(yaw_enu_deg))
    assert off == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("inside_deg", "wire_deg"),
    [
        ((0, 20, 0), (0, -20, 90)),  # nose down, flying east
        ((15, 0, 90), (15, 0, 0)),  # right side down, nose north
        ((15, 20, 60), (15, -20, 30)),
        ((-10, -5, 170), (-10, 5, -80)),
    ],
)
def test_euler_angles_on_the_wire(inside_deg, wire_deg):
    wire = frames.attitude_to_wire(frames.quaternion_from_euler(*map(R, inside_deg)))
    assert tuple(map(D, frames.euler_from_quaternion(wire))) == pytest.approx(wire_deg, abs=1e-9)


def test_a_nose_down_pitch_pushes_forward():
    east, north, up = frames.rotate(frames.quaternion_from_euler(0, R(20), 0), (0, 0, 1))
    assert (east, north, up) == pytest.approx((math.sin(R(20)), 0, math.cos(R(20))))


def test_a_roll_to_the_right_pushes_right():
    east, north, _ = frames.rotate(frames.quaternion_from_euler(R(20), 0, 0), (0, 0, 1))
    assert (east, north) == pytest.approx((0, -math.sin(R(20))))


def test_i_times_j_is_k():
    i, j, k = (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)
    assert frames.quaternion_multiply(i, j) == k
    assert frames.quaternion_multiply(j, i) == (0, 0, 0, -1)


def test_normalising_keeps_the_direction():
    assert frames.quaternion_normalise((2, 0, -2, 0)) == pytest.approx(
        (math.sqrt(0.5), 0, -math.sqrt(0.5), 0)
    )


@pytest.mark.parametrize("q", [(0, 0, 0, 0), (math.nan, 0, 0, 1), (math.inf, 0, 0, 0)])
def test_a_quaternion_without_direction_is_refused(q):
    with pytest.raises(ValueError, match="has no direction"):
        frames.quaternion_normalise(q)
