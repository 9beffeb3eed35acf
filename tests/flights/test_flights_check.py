"""`companion check` on both flavours of the shim, in lockstep: what it finds and leaves."""

import asyncio
import struct
from dataclasses import dataclass, field, replace

import pytest

from companion.config.resolve import load_flight
from companion.flight.assemble import make_trajectory
from companion.flight.check.checking import CheckOrder
from companion.flight.check.restore_file import RestoreList, read_restore_file
from companion.flight.embedded_shim import embedded_shim
from companion.lockstep import check_in_lockstep
from companion.mavlink.codec import Packer, encode
from companion.mavlink.messages import MessageId
from companion.preflight.finding import ParameterChange, changes_of, worst
from tests.flights.wire import Packet

FLAVOURS = ("px4", "ardupilot")
READY_S = {"px4": "20", "ardupilot": "30"}
_ASKING = {511, 512}
"""SET_MESSAGE_INTERVAL, REQUEST_MESSAGE."""
_COMMAND = struct.Struct("<7fHBBB")


@dataclass
class Listener:
    """Remembers what the companion sends; `from_shim` may tamper with what it gets."""

    sent: list[Packet] = field(default_factory=list)
    from_shim: object = None

    def to_shim(self, raw):
        self.sent.append(Packet(asyncio.get_running_loop().time(), raw))
        return raw

    def to_companion(self, raw):
        packet = Packet(asyncio.get_running_loop().time(), raw)
        return raw if self.from_shim is None else self.from_shim(packet)

    @property
    def message_ids(self):
        return {packet.message_id for packet in self.sent}

    @property
    def commands(self):
        longs = [p for p in self.sent if p.message_id == MessageId.COMMAND_LONG]
        return [p.fields(_COMMAND) for p in longs]


def check(
    flavour,
    *,
    parameters=None,
    settings=None,
    listener=None,
    told=None,
    key=None,
    shim_key=None,
    **order,
):
    keys = {"timeouts.connect_s": READY_S[flavour], **(settings or {})}
    config = load_flight(None, {"autopilot": flavour, "seed": 1}, keys)
    shim = replace(embedded_shim(config), parameters=parameters or {}, signing_key=shim_key)
    listener = listener or Listener()
    messages = [] if told is None else told
    return check_in_lockstep(
        CheckOrder(config, make_trajectory(config.mission), **order),
        lambda severity, text: messages.append((severity, text)),
        shim,
        from_shim=listener.to_companion,
        to_shim=listener.to_shim,
        signing_key=key,
    )


def finding_of(checked, subject):
    (found,) = [finding for finding in checked.findings if finding.subject == subject]
    return found


def verdicts(checked, *kinds):
    return {f.subject for f in checked.findings if f.verdict in kinds}


def test_on_px4_as_it_comes_nothing_stands_against_a_flight():
    checked = check("px4")
    assert verdicts(checked, "warning", "refusal") == set()
    assert finding_of(checked, "autopilot").found.startswith("PX4 1.17.0")
    assert checked.facts.link.round_trips_s
    (state,) = [s for s in checked.facts.streams if s.is_state]
    assert state.measured_hz == pytest.approx(100.0, rel=0.03)


def test_on_ardupilot_as_it_comes_nothing_catches_a_dead_companion():
    checked = check("ardupilot")
    assert verdicts(checked, "refusal") == set()
    assert verdicts(checked, "warning") == {"GUID_TIMEOUT", "FS_GCS_ENABLE"}
    assert finding_of(checked, "autopilot").found.startswith("ArduPilot 4.7")
    assert finding_of(checked, "ready to arm").verdict == "note"  # it is not in GUIDED
    names = {s.name for s in checked.facts.streams if s.is_state}
    assert names == {"LOCAL_POSITION_NED", "ATTITUDE_QUATERNION"}


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_it_changes_nothing_and_gives_the_streams_back(flavour):
    listener = Listener()
    check(flavour, listener=listener)
    assert MessageId.PARAM_SET not in listener.message_ids
    assert MessageId.SET_ATTITUDE_TARGET not in listener.message_ids
    commands = listener.commands
    assert {command[7] for command in commands} == _ASKING
    asked = {int(c[0]): c[1] for c in commands if c[7] == 511}
    assert set(asked.values()) == {0.0} | {v for v in asked.values() if v > 0.0}
    # What was refused was never changed; all else ends at the autopilot's own rate.
    granted = {int(c[0]) for c in commands if c[7] == 511 and c[1] == 0.0}
    assert granted >= {MessageId.SYS_STATUS, MessageId.EXTENDED_SYS_STATE}


@pytest.mark.parametrize(
    ("parameters", "subject", "verdict"),
    [
        ({"COM_OF_LOSS_T": 10.0}, "COM_OF_LOSS_T", "warning"),
        ({"COM_OBL_RC_ACT": 7}, "COM_OBL_RC_ACT", "refusal"),
        ({"MPC_THR_HOVER": 0.3}, "MPC_THR_HOVER", "warning"),
        ({"EKF2_PREDICT_US": 20000}, "ODOMETRY", "warning"),
    ],
)
def test_px4_set_badly_is_named(parameters, subject, verdict):
    checked = check("px4", parameters=parameters)
    assert finding_of(checked, subject).verdict == verdict
    assert verdicts(checked, "warning", "refusal") == {subject}


@pytest.mark.parametrize(
    ("parameters", "settings", "subject", "verdict"),
    [
        ({"GUID_TIMEOUT": 5.0}, {}, "GUID_TIMEOUT", "warning"),
        ({"GUID_OPTIONS": 8}, {"preflight.thrust_field": "climb_rate"}, "GUID_OPTIONS", "refusal"),
        ({}, {"preflight.thrust_field": "thrust"}, "GUID_OPTIONS", "refusal"),
        ({"WPNAV_SPEED_UP": 50.0}, {}, "WPNAV_SPEED_UP", "warning"),
        ({"GUID_OPTIONS": 8, "MOT_THST_HOVER": 0.2}, {}, "MOT_THST_HOVER", "warning"),
    ],
)
def test_ardupilot_set_badly_is_named(parameters, settings, subject, verdict):
    well = {"GUID_TIMEOUT": 0.5, "FS_GCS_ENABLE": 5, "MAV_GCS_SYSID": 1}
    checked = check("ardupilot", parameters=well | parameters, settings=settings)
    assert finding_of(checked, subject).verdict == verdict
    assert verdicts(checked, "warning", "refusal") == {subject}


def test_a_thrust_field_that_cannot_be_flown_is_refused():
    """GUID_OPTIONS is never answered: the meaning of the field is not known."""
    listener = Listener()
    name = struct.Struct("<fHH16s")

    def lose_it(packet):
        value = packet.message_id == MessageId.PARAM_VALUE
        return b"" if value and packet.fields(name)[3].startswith(b"GUID_OPT") else packet.raw

    listener.from_shim = lose_it
    checked = check("ardupilot", listener=listener)
    thrust = finding_of(checked, "thrust")
    assert thrust.verdict == "refusal"
    assert "GUID_OPTIONS" in thrust.found


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_a_stream_that_comes_slowly_is_named(flavour):
    listener = Listener()
    count = 0

    def thin_out(packet):
        nonlocal count
        if packet.component_id == 1 and packet.message_id in (
            MessageId.ODOMETRY,
            MessageId.LOCAL_POSITION_NED,
        ):
            count += 1
            return b"" if count % 5 else packet.raw
        return packet.raw

    listener.from_shim = thin_out
    checked = check(flavour, listener=listener)
    name = {"px4": "ODOMETRY", "ardupilot": "LOCAL_POSITION_NED"}[flavour]
    found = finding_of(checked, name)
    assert found.verdict == "refusal"
    assert "20 Hz, 100 Hz asked for" in found.found
    assert "loss" in verdicts(checked, "warning")


def test_a_dead_link_ends_with_what_is_missing():
    listener = Listener(from_shim=lambda packet: b"")
    checked = check("px4", listener=listener, settings={"timeouts.connect_s": "3"})
    (found,) = checked.findings
    assert found.verdict == "refusal"
    assert found.found.startswith("no HEARTBEAT of one came")
    assert checked.facts is None
    assert listener.sent == []


@pytest.mark.parametrize("after_s", [2.0, 3.5])
def test_a_link_that_dies_in_the_middle_ends_with_that(after_s):
    listener = Listener(from_shim=lambda p: p.raw if p.time_s < after_s else b"")
    checked = check("px4", listener=listener)
    (found,) = checked.findings
    assert found.verdict == "refusal"
    assert found.subject == "link"
    assert "nothing was heard for" in found.found


def test_an_autopilot_without_a_state():
    listener = Listener(from_shim=lambda p: b"" if p.message_id == MessageId.ODOMETRY else p.raw)
    checked = check("px4", listener=listener, settings={"timeouts.connect_s": "3"})
    assert finding_of(checked, "ODOMETRY").verdict == "refusal"
    assert finding_of(checked, "delay").verdict == "ok"


def test_another_kind_of_autopilot_than_asked_for():
    config = load_flight(None, {"autopilot": "px4", "seed": 1}, {})
    shim = embedded_shim(config)
    other = load_flight(None, {"autopilot": "ardupilot", "seed": 1}, {})
    order = CheckOrder(other, make_trajectory(other.mission))
    checked = check_in_lockstep(order, lambda severity, text: None, shim)
    (found,) = checked.findings
    assert "it is PX4, and ardupilot was asked for" in found.found


def test_a_second_vehicle_and_a_ground_station_are_told(tmp_path):
    listener = Listener()
    station, second = Packer(255, 190), Packer(2, 1)

    def mix_in(packet):
        if packet.message_id != MessageId.HEARTBEAT or packet.component_id != 1:
            return packet.raw
        heartbeat = {"base_mode": 0, "custom_mode": 0, "system_status": 3, "mavlink_version": 3}
        return (
            packet.raw
            + station.pack(encode("HEARTBEAT", type=6, autopilot=8, **heartbeat))
            + second.pack(encode("HEARTBEAT", type=2, autopilot=3, **heartbeat))
        )

    listener.from_shim = mix_in
    checked = check("px4", listener=listener)
    assert finding_of(checked, "autopilot").found.endswith("system 1, component 1")
    assert "system 2, component 1" in finding_of(checked, "other vehicles").found
    assert "system 255, component 190" in finding_of(checked, "others on the link").found


@pytest.mark.parametrize(
    ("flavour", "bad", "names"),
    [
        ("px4", {"COM_OF_LOSS_T": 10.0, "COM_OBL_RC_ACT": 2}, ["COM_OF_LOSS_T", "COM_OBL_RC_ACT"]),
        ("ardupilot", {}, ["GUID_TIMEOUT", "MAV_GCS_SYSID", "FS_GCS_ENABLE"]),
    ],
)
def test_fix_sets_what_was_named_says_so_and_lists_it_before(flavour, bad, names, tmp_path):
    told, path = [], tmp_path / "restore.json"
    listener = Listener()
    listed_first = []

    def watch(packet):
        if packet.message_id == MessageId.PARAM_VALUE:
            listed_first.append(path.exists())
        return packet.raw

    listener.from_shim = watch
    checked = check(flavour, parameters=bad, told=told, listener=listener, fix_into=path)
    assert [text.split()[1] for _, text in told] == names
    assert all(" from " in text and ": " in text for _, text in told)
    assert {severity for severity, _ in told} == {"warning"}  # shown without --verbose
    listed = read_restore_file(path)
    assert (listed.autopilot, listed.system_id) == (flavour, 1)
    assert [change.name for change in listed.changes] == names
    assert worst(checked.findings).weight <= 1
    assert {p.message_id for p in listener.sent} >= {MessageId.PARAM_SET}
    # With what it set, the next check finds nothing to set any more.
    now = bad | {change.name: change.new for change in listed.changes}
    assert changes_of(check(flavour, parameters=now).findings) == []


def as_if(base_mode=None, landed_state=None):
    """The vehicle says that it is armed, or not on the ground."""
    heartbeat = struct.Struct("<IBBBBB")

    def tamper(packet):
        if packet.component_id != 1:
            return packet.raw
        if packet.message_id == MessageId.HEARTBEAT and base_mode is not None:
            mode, kind, autopilot, base, *rest = packet.fields(heartbeat)
            return packet.with_payload(
                heartbeat.pack(mode, kind, autopilot, base | base_mode, *rest)
            )
        if packet.message_id == MessageId.EXTENDED_SYS_STATE and landed_state is not None:
            return packet.with_payload(bytes([0, landed_state]))
        return packet.raw

    return tamper


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize(
    ("state", "text"),
    [({"base_mode": 0x80}, "armed"), ({"landed_state": 2}, "in the air")],
)
def test_fix_sets_nothing_on_a_vehicle_that_is_in_use(flavour, state, text, tmp_path):
    """A failsafe set for good lands a flying vehicle once the check has ended."""
    listener, path = Listener(from_shim=as_if(**state)), tmp_path / "restore.json"
    bad = {"COM_OF_LOSS_T": 10.0} if flavour == "px4" else {}
    checked = check(flavour, parameters=bad, listener=listener, fix_into=path)
    assert MessageId.PARAM_SET not in listener.message_ids
    assert not path.exists()
    found = finding_of(checked, "--fix")
    assert found.verdict == "refusal"
    assert f"nothing is set: the vehicle is {text}" in found.found
    assert found.advice == "Land and disarm first."
    assert finding_of(checked, "state").verdict == "refusal"
    # What would have been set is still named.
    assert changes_of(checked.findings)


def test_fix_sets_no_further_once_the_vehicle_is_armed(tmp_path):
    listener, armed = Listener(), as_if(base_mode=0x80)

    def arm_at_the_first(packet):
        begun = MessageId.PARAM_SET in listener.message_ids
        return armed(packet) if begun else packet.raw

    listener.from_shim = arm_at_the_first
    lose_first(listener, "GUID_TIMEOUT", 3)
    checked = check("ardupilot", listener=listener, fix_into=tmp_path / "restore.json")
    assert sets(listener) == {"GUID_TIMEOUT"}
    problems = [f.found for f in checked.findings if f.subject == "--fix"]
    assert problems == [
        "MAV_GCS_SYSID was not set: the vehicle is armed.",
        "FS_GCS_ENABLE was not set: the vehicle is armed.",
    ]


def sets(listener):
    layout = struct.Struct("<fBB16sB")
    asked = [p.fields(layout) for p in listener.sent if p.message_id == MessageId.PARAM_SET]
    return {fields[3].rstrip(b"\0").decode() for fields in asked}


def lose_first(listener, name, count):
    """The companion's first so many requests to set a parameter are lost on the way."""
    layout, to_shim, lost = struct.Struct("<fBB16sB"), listener.to_shim, []

    def lose(raw):
        raw = to_shim(raw)
        packet = listener.sent[-1]
        if packet.message_id != MessageId.PARAM_SET or len(lost) == count:
            return raw
        if not packet.fields(layout)[3].startswith(name.encode()):
            return raw
        lost.append(packet)
        return b""

    listener.to_shim = lose


def test_what_could_not_be_set_is_judged_as_it_is_then(tmp_path):
    listener = Listener()
    lose_first(listener, "FS_GCS_ENABLE", 100)
    checked = check("ardupilot", listener=listener, fix_into=tmp_path / "restore.json")
    assert sets(listener) == {"GUID_TIMEOUT", "MAV_GCS_SYSID", "FS_GCS_ENABLE"}
    assert "FS_GCS_ENABLE could not be set" in finding_of(checked, "--fix").found
    assert finding_of(checked, "FS_GCS_ENABLE").verdict == "warning"
    assert finding_of(checked, "FS_GCS_ENABLE").found == "0: nothing catches a dead companion"
    assert finding_of(checked, "GUID_TIMEOUT").verdict == "ok"
    assert [change.name for change in changes_of(checked.findings)] == ["FS_GCS_ENABLE"]
    assert checked.facts.parameters["FS_GCS_ENABLE"] == 0.0
    assert checked.facts.parameters["GUID_TIMEOUT"] == 0.5


def test_fix_does_not_write_over_the_list_of_an_earlier_flight(tmp_path):
    path = tmp_path / "restore.json"
    path.write_text("{}")
    listener = Listener()
    checked = check("px4", parameters={"COM_OF_LOSS_T": 10.0}, listener=listener, fix_into=path)
    assert finding_of(checked, "--fix").verdict == "refusal"
    assert "wait to be restored" in finding_of(checked, "--fix").found
    assert MessageId.PARAM_SET not in listener.message_ids


def test_restore_sets_back_in_reverse_and_leaves_what_somebody_else_has_set():
    changes = (
        ParameterChange("GUID_TIMEOUT", 3.0, 0.5, ""),
        ParameterChange("MAV_GCS_SYSID", 255.0, 1.0, ""),
        ParameterChange("FS_GCS_ENABLE", 0.0, 5.0, ""),
    )
    told, listener = [], Listener()
    now = {"GUID_TIMEOUT": 0.5, "MAV_GCS_SYSID": 7, "FS_GCS_ENABLE": 5}
    restore = RestoreList("ardupilot", 1, changes)
    checked = check("ardupilot", parameters=now, told=told, listener=listener, restore=restore)
    assert checked.restored
    assert [(s, t.split()[0:2]) for s, t in told] == [
        ("warning", ["restored", "FS_GCS_ENABLE"]),
        ("warning", ["MAV_GCS_SYSID", "is"]),
        ("warning", ["restored", "GUID_TIMEOUT"]),
    ]
    assert [finding.subject for finding in checked.findings] == ["--restore"]
    assert not {511, 512} & {command[7] for command in listener.commands}


def test_restore_is_refused_on_another_vehicle():
    restore = RestoreList("px4", 4, (ParameterChange("COM_OF_LOSS_T", 3.0, 1.0, ""),))
    listener = Listener()
    checked = check("px4", listener=listener, restore=restore)
    (found,) = checked.findings
    assert found.verdict == "refusal"
    assert "the file is of system 4 (px4), this is system 1 (px4)" in found.found
    assert MessageId.PARAM_SET not in listener.message_ids


def test_a_signed_link_is_checked_with_the_key_and_not_without(tmp_path):
    key = bytes(range(1, 33))
    signed = check("px4", key=key, shim_key=key)
    assert finding_of(signed, "signing").found == "on"
    assert verdicts(signed, "warning", "refusal") == set()
    (found,) = check("px4", shim_key=key).findings
    assert found.verdict == "refusal"
    assert "--signing-key-file" in found.advice
    (found,) = check(
        "px4", key=bytes(32 * [7]), shim_key=key, settings={"timeouts.connect_s": "3"}
    ).findings
    assert found.verdict == "refusal"
    assert "signatures are not by our key" in found.advice
