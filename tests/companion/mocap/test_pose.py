import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.frames import quaternion_from_euler, rotate, yaw_of
from companion.mocap.pose import RoomAxes, RoomPose

angles = st.floats(-3.0, 3.0)
coordinates = st.floats(-10.0, 10.0)


def axes(y_up=False, room=0.0, body=0.0):
    return RoomAxes(y_up=y_up, room_yaw_rad=room, body_yaw_rad=body)


def seen(position=(0.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0)):
    return RoomPose(0.0, position, attitude)


def test_z_up_is_taken_as_it_is():
    attitude = quaternion_from_euler(0.1, 0.2, 0.3)
    pose = axes().pose(seen((1.0, 2.0, 3.0), attitude), 7.0)
    assert pose.captured_s == 7.0
    assert pose.position_enu_m == pytest.approx((1.0, 2.0, 3.0))
    assert pose.attitude_flu_to_enu == pytest.approx(attitude)


def test_y_up_becomes_up_and_the_right_hand_stays_right():
    pose = axes(y_up=True).pose(seen((1.0, 2.0, 3.0)), 0.0)
    assert pose.position_enu_m == pytest.approx((1.0, -3.0, 2.0))
    assert pose.attitude_flu_to_enu == pytest.approx((1.0, 0.0, 0.0, 0.0))


def test_turning_about_the_rooms_y_is_yaw_where_y_is_up():
    half = 0.25
    pose = axes(y_up=True).pose(seen(attitude=(math.cos(half), 0.0, math.sin(half), 0.0)), 0.0)
    assert yaw_of(pose.attitude_flu_to_enu) == pytest.approx(0.5)


def test_the_room_and_the_body_are_turned_by_their_yaws():
    pose = axes(room=math.pi / 2, body=0.3).pose(seen((1.0, 0.0, 5.0)), 0.0)
    assert pose.position_enu_m == pytest.approx((0.0, 1.0, 5.0))
    assert yaw_of(pose.attitude_flu_to_enu) == pytest.approx(math.pi / 2 + 0.3)


@settings(deadline=None, derandomize=True, max_examples=60)
@given(st.booleans(), angles, st.tuples(angles, st.floats(-1.4, 1.4), angles), coordinates)
def test_a_marker_on_the_body_stays_where_the_room_saw_it(y_up, room, euler, reach):
    """Position and attitude are turned alike: the law that a wrong pair of axes breaks."""
    attitude = quaternion_from_euler(*euler)
    marker_in_room = rotate(attitude, (reach, 0.0, 0.0))
    turn = axes(y_up, room)
    pose = turn.pose(seen((0.0, 0.0, 0.0), attitude), 0.0)
    moved = turn.pose(seen(marker_in_room, attitude), 0.0)
    # The rigid body's x axis is the nose, in either kind of room.
    assert moved.position_enu_m == pytest.approx(
        rotate(pose.attitude_flu_to_enu, (reach, 0.0, 0.0)), abs=1e-9
    )
