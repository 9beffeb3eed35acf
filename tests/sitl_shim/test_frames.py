import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.frames import (
    attitude_from_wire,
    attitude_to_wire,
    euler_from_quaternion,
    quaternion_conjugate,
    quaternion_from_euler,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
    rotate_inverse,
    rotation_matrix,
    swap_enu_ned,
    swap_flu_frd,
    wrap_angle_rad,
)

laws = settings(deadline=None, derandomize=True)
components = st.floats(-1.0, 1.0, allow_subnormal=False)
vectors = st.tuples(*[st.floats(-100.0, 100.0, allow_subnormal=False)] * 3)
attitudes = (
    st.tuples(components, components, components, components)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(quaternion_normalise)
)


def close(actual, expected, tolerance=1e-9):
    return all(abs(a - b) <= tolerance for a, b in zip(actual, expected, strict=True))


def same_rotation(a, b, tolerance=1e-9):
    return close(a, b, tolerance) or close(a, [-c for c in b], tolerance)


@laws
@given(vectors)
def test_swapping_world_or_body_twice_gives_the_vector_back(vector):
    assert swap_enu_ned(swap_enu_ned(vector)) == vector
    assert swap_flu_frd(swap_flu_frd(vector)) == vector


def test_swaps_put_each_axis_where_it_belongs():
    assert swap_enu_ned((1.0, 2.0, 3.0)) == (2.0, 1.0, -3.0)
    assert swap_flu_frd((1.0, 2.0, 3.0)) == (1.0, -2.0, -3.0)


@laws
@given(attitudes, attitudes, vectors)
def test_a_product_rotates_by_its_right_factor_first(a, b, vector):
    assert close(rotate(quaternion_multiply(a, b), vector), rotate(a, rotate(b, vector)), 1e-6)


@laws
@given(attitudes, attitudes, attitudes)
def test_multiplication_is_associative(a, b, c):
    left = quaternion_multiply(quaternion_multiply(a, b), c)
    assert close(left, quaternion_multiply(a, quaternion_multiply(b, c)))


@laws
@given(attitudes)
def test_the_conjugate_undoes_a_rotation(q):
    assert close(quaternion_multiply(q, quaternion_conjugate(q)), (1.0, 0.0, 0.0, 0.0))


@laws
@given(attitudes, vectors)
def test_rotating_back_and_keeping_length(q, vector):
    turned = rotate(q, vector)
    assert close(rotate_inverse(q, turned), vector, 1e-6)
    assert math.hypot(*turned) == pytest.approx(math.hypot(*vector), abs=1e-6)


@laws
@given(attitudes, vectors)
def test_the_matrix_rotates_as_the_quaternion_does(q, vector):
    by_matrix = [sum(m * v for m, v in zip(row, vector, strict=True)) for row in rotation_matrix(q)]
    assert close(by_matrix, rotate(q, vector), 1e-6)


def test_a_yaw_of_a_quarter_turn_takes_forward_to_north_from_east():
    q = quaternion_from_euler(0.0, 0.0, math.pi / 2)
    assert close(rotate(q, (1.0, 0.0, 0.0)), (0.0, 1.0, 0.0))
    assert close(rotate(q, (0.0, 1.0, 0.0)), (-1.0, 0.0, 0.0))


def test_a_positive_pitch_lowers_the_nose_and_a_positive_roll_lowers_the_right_side():
    nose_down = rotate(quaternion_from_euler(0.0, 0.3, 0.0), (1.0, 0.0, 0.0))
    assert nose_down[2] == pytest.approx(-math.sin(0.3))
    left_wing = rotate(quaternion_from_euler(0.3, 0.0, 0.0), (0.0, 1.0, 0.0))
    assert left_wing[2] == pytest.approx(math.sin(0.3))


@laws
@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_euler_angles_round_trip(roll, pitch, yaw):
    q = quaternion_from_euler(roll, pitch, yaw)
    assert close(euler_from_quaternion(q), (roll, pitch, yaw), 1e-7)


@laws
@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_euler_angles_are_yaw_then_pitch_then_roll(roll, pitch, yaw):
    product = quaternion_multiply(
        quaternion_from_euler(0.0, 0.0, yaw),
        quaternion_multiply(
            quaternion_from_euler(0.0, pitch, 0.0), quaternion_from_euler(roll, 0.0, 0.0)
        ),
    )
    assert close(quaternion_from_euler(roll, pitch, yaw), product)


@laws
@given(attitudes)
def test_the_wire_and_back_is_the_same_attitude(q):
    assert same_rotation(attitude_from_wire(attitude_to_wire(q)), q)
    assert same_rotation(attitude_to_wire(attitude_from_wire(q)), q)


@laws
@given(attitudes, vectors)
def test_the_wire_rotates_wire_vectors_as_the_world_rotates_its_own(q, body_flu):
    by_wire = rotate(attitude_to_wire(q), swap_flu_frd(body_flu))
    assert close(by_wire, swap_enu_ned(rotate(q, body_flu)), 1e-6)


@laws
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_on_the_wire_roll_stays_pitch_turns_sign_and_yaw_counts_from_north(roll, pitch, yaw):
    wire = euler_from_quaternion(attitude_to_wire(quaternion_from_euler(roll, pitch, yaw)))
    assert close(wire, (roll, -pitch, wrap_angle_rad(math.pi / 2 - yaw)), 1e-7)


@laws
@given(st.floats(-1e3, 1e3))
def test_wrapping_keeps_the_angle_and_bounds_it(angle):
    wrapped = wrap_angle_rad(angle)
    assert -math.pi <= wrapped < math.pi
    turns = (angle - wrapped) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)


def test_wrapping_just_below_minus_pi_stays_in_range():
    assert -math.pi <= wrap_angle_rad(math.nextafter(-math.pi, -4.0)) < math.pi


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0), (math.inf,) * 4])
def test_what_says_no_attitude_cannot_be_normalised(q):
    with pytest.raises(ValueError, match="no attitude"):
        quaternion_normalise(q)
