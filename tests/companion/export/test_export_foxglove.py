import itertools
import json
import math

import pytest

from companion.export.errors import ExportError
from companion.export.foxglove import write_foxglove
from companion.export.scene import MOST_POINTS, ThinnedPath, tilt_deg
from companion.recording.flight_files import flight_files
from companion.recording.mcap_reader import read_records


@pytest.fixture(scope="module")
def drawn(flown_once, tmp_path_factory):
    """Messages of the exported file by topic, each with its time in nanoseconds since 1970."""
    from mcap.reader import make_reader

    path = tmp_path_factory.mktemp("drawn") / "foxglove.mcap"
    write_foxglove(flight_files(flown_once), path, lambda *_: None)
    topics = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages():
            topics.setdefault(channel.topic, []).append(
                (message.log_time, json.loads(message.data))
            )
    return topics


@pytest.fixture(scope="module")
def control(flown_once):
    return [r.values for r in read_records(flown_once / "flight.mcap") if r.topic == "control"]


def test_the_flights_own_records_are_all_there_as_they_were(drawn, control):
    assert [values for _, values in drawn["control"]] == control


def test_the_transform_moves_the_body_as_the_autopilot_reported(drawn, control):
    flown = [c for c in control if c["position_enu_m"][0] is not None]
    assert len(drawn["transform"]) == len(flown)
    for (_, told), values in zip(drawn["transform"], flown, strict=True):
        assert list(told["translation"].values()) == values["position_enu_m"]
        w, x, y, z = values["attitude_flu_to_enu"]
        assert told["rotation"] == {"x": x, "y": y, "z": z, "w": w}


def test_stamps_are_the_times_of_the_log(drawn):
    for topic in ("transform", "pose", "true_pose", "desired"):
        for time_ns, told in drawn[topic]:
            assert told["timestamp"]["sec"] * 10**9 + told["timestamp"]["nsec"] == time_ns


def test_the_file_is_in_the_order_of_time(flight, quiet):
    from mcap.stream_reader import StreamReader

    write_foxglove(flight_files(flight), flight / "f.mcap", quiet)
    with (flight / "f.mcap").open("rb") as file:
        times = [m.log_time for m in StreamReader(file).records if hasattr(m, "log_time")]
    assert len(times) > 1000
    assert times == sorted(times)


def test_the_scene_holds_both_paths_the_geofence_and_the_vehicle(drawn, control):
    ((time_ns, scene),) = drawn["scene"]
    assert time_ns == min(t for topic in drawn.values() for t, _ in topic)
    entities = {entity["id"]: entity for entity in scene["entities"]}
    assert set(entities) == {"desired path", "flown path", "geofence", "vehicle"}
    assert entities["vehicle"]["frame_id"] == "body"
    tracked = [c["desired_enu_m"] for c in control if c["phase"] == "track"]
    (line,) = entities["desired path"]["lines"]
    assert [list(p.values()) for p in line["points"]] == tracked
    (box,) = entities["geofence"]["lines"]
    assert len(box["points"]) == 24
    highest = max(point["z"] for point in box["points"])
    assert highest > max(p[2] for p in tracked)


def test_the_error_is_the_distance_to_the_desired_position(drawn, control):
    both = [c for c in control if None not in c["position_enu_m"] + c["desired_enu_m"]]
    told = [values["error_mm"] for _, values in drawn["tracking"] if "error_mm" in values]
    expected = [1e3 * math.dist(c["position_enu_m"], c["desired_enu_m"]) for c in both]
    assert told == pytest.approx(expected)
    assert max(told) > 1.0


def test_the_true_pose_is_near_the_reported_one_and_not_it(drawn):
    reported = [told["pose"]["position"] for _, told in drawn["pose"]]
    true = [told["pose"]["position"] for _, told in drawn["true_pose"]]
    assert max(p["z"] for p in true) == pytest.approx(max(p["z"] for p in reported), abs=0.1)
    assert true[-1] not in reported


def test_what_a_person_was_told_is_in_the_log_panel(drawn):
    told = {values["message"]: values for _, values in drawn["messages"]}
    assert any(text.startswith("phase track") for text in told)
    assert {values["level"] for values in told.values()} <= {1, 2, 3, 4, 5}


def test_the_location_is_in_degrees_and_metres(drawn):
    _, fix = drawn["location"][-1]
    assert 47.0 < fix["latitude"] < 48.0
    assert 8.0 < fix["longitude"] < 9.0
    assert 400.0 < fix["altitude"] < 600.0


def test_the_paths_are_bounded_however_long_the_flight_is():
    path = ThinnedPath()
    for k in range(20 * MOST_POINTS + 7):
        path.add((float(k), 0.0, 0.0))
    points = [x for x, _, _ in path.points]
    assert MOST_POINTS / 2 <= len(points) <= MOST_POINTS + 1
    assert points[0] == 0.0
    steps = {b - a for a, b in itertools.pairwise(points)}
    assert len(steps) == 1


@pytest.mark.parametrize("angle", [0.0, 10.0, 90.0, 170.0])
def test_the_tilt_is_the_angle_to_the_vertical_whatever_the_heading(angle):
    half, heading = math.radians(angle) / 2, 0.7
    yaw, roll = (math.cos(heading), math.sin(heading)), (math.cos(half), math.sin(half))
    attitude = (yaw[0] * roll[0], yaw[0] * roll[1], yaw[1] * roll[1], yaw[1] * roll[0])
    assert tilt_deg(attitude) == pytest.approx(angle, abs=1e-6)


def test_a_flight_without_packets_is_drawn_too(flight, quiet, messages_of):
    (flight / "flight.tlog").unlink()
    write_foxglove(flight_files(flight), flight / "f.mcap", quiet)
    topics = {channel.topic for _, channel, _, _ in messages_of(flight / "f.mcap")}
    assert "transform" in topics
    assert "true_pose" not in topics


def test_an_empty_log_is_refused(tmp_path, quiet):
    (tmp_path / "flight.mcap").write_bytes(b"")
    with pytest.raises(ExportError, match="holds no records"):
        write_foxglove(flight_files(tmp_path), tmp_path / "f.mcap", quiet)
