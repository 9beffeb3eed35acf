import json
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.mocap.json_input import LONGEST, DroppedError, read_pose, write_pose
from companion.mocap.pose import RoomPose

GOOD = {"body": "drone", "t": 1.5, "position": [1.0, 2, 3.0], "attitude": [1.0, 0.0, 0.0, 0.0]}


def datagram(**changes):
    return json.dumps(GOOD | changes).encode()


def reason(data, body="drone"):
    with pytest.raises(DroppedError) as caught:
        read_pose(data, body)
    return str(caught.value)


def test_a_pose_is_read_as_it_is_documented():
    pose = read_pose(datagram(extra="ignored"), "drone")
    assert pose == RoomPose(1.5, (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))


def test_what_is_written_is_read_back():
    pose = RoomPose(12.345678, (0.1, -2.0, 3.5), (0.5, -0.5, 0.5, 0.5))
    assert read_pose(write_pose("a b", pose), "a b") == pose


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "not JSON"),
        (b"\xff\xfe", "not JSON"),
        (b"{", "not JSON"),
        (b"[" * 3000, "not JSON"),
        (datagram(padding="x" * LONGEST), "not JSON"),
        (b"[1, 2]", "not a pose"),
        (datagram(body="other"), "of another body"),
        (datagram(body=None), "of another body"),
        (datagram(t="1.5"), "not a pose"),
        (datagram(t=True), "not a pose"),
        (datagram(t=None), "not a pose"),
        (datagram(position=[1.0, 2.0]), "not a pose"),
        (datagram(position={"x": 1}), "not a pose"),
        (datagram(position=[1.0, 2.0, math.nan]), "not a number"),
        (datagram(position=[1.0, 2.0, math.inf]), "not a number"),
        (datagram(position=[1.0, 2.0, 10**400]), "not a number"),
        (datagram(t=math.nan), "not a number"),
        (datagram(attitude=[0.0, 0.0, 0.0, 0.0]), "not a rotation"),
        (datagram(attitude=[2.0, 0.0, 0.0, 0.0]), "not a rotation"),
        (datagram(attitude=[1.0, 0.0, 0.0]), "not a pose"),
    ],
)
def test_what_is_no_pose_is_dropped_with_its_reason(data, why):
    assert reason(data) == why


def test_a_nearly_unit_quaternion_is_made_one():
    pose = read_pose(datagram(attitude=[1.02, 0.0, 0.0, 0.0]), "drone")
    assert pose.attitude == (1.0, 0.0, 0.0, 0.0)


@settings(deadline=None, derandomize=True, max_examples=200)
@given(st.binary(max_size=300))
def test_no_bytes_raise_anything_else(data):
    with pytest.raises(DroppedError):
        read_pose(data, "drone")
