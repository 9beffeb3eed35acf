"""The check before a flight: what it tells, what it refuses, what it sets and sets back."""

import struct
from contextlib import suppress

import pytest

from companion.flight.check.restore_file import RESTORE_NAME, read_restore_file
from companion.flight.inbox import PilotCommand
from companion.mavlink.messages import MessageId, Outgoing
from tests.flights.bench import Bench

_SET = struct.Struct("<fBB16sB")
_COMMAND = struct.Struct("<7fHBBB")
_ACK = struct.Struct("<HBBiBB")
UNFIXED = {"COM_OF_LOSS_T": 8.0}
FIX = {"preflight.fix": "true"}
AS_SHIPPED = ["GUID_TIMEOUT", "MAV_GCS_SYSID", "FS_GCS_ENABLE"]


class Setting:
    """Remembers what was set, and whether the vehicle was armed and the list written then."""

    def __init__(self, bench):
        self.bench = bench
        self.set = []
        self.armed = []
        self.listed = []
        bench.wire.to_shim = self.take

    def take(self, packet):
        if packet.message_id == MessageId.PARAM_SET:
            name = packet.fields(_SET)[3].rstrip(b"\0").decode()
            self.set.append(name)
            self.armed.append(bool(self.bench.wire.armed and self.bench.wire.armed[-1][1]))
            self.listed.append((self.bench.folder / "flight" / RESTORE_NAME).exists())
        return packet.raw


def restore_file(flown):
    return flown.folder / RESTORE_NAME


def test_on_px4_as_it_comes_a_flight_says_nothing_of_its_check_and_takes_no_longer(bench):
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    assert [m for m in flown.seen.messages if m[1] == "warning"] == []
    # PX4 itself would not arm before 4.2 s; then its next HEARTBEAT is waited for.
    assert flown.began("arm") < 5.3


def test_on_ardupilot_as_it_comes_a_flight_warns_and_sets_nothing(bench):
    setting = Setting(bench)
    flown = bench.fly(options={"autopilot": "ardupilot"})
    assert flown.outcome.outcome == "landed"
    warnings = [text for _, severity, text in flown.seen.messages if severity == "warning"]
    assert [text.split(":")[0] for text in warnings] == ["GUID_TIMEOUT", "FS_GCS_ENABLE"]
    assert setting.set == []


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"COM_OBL_RC_ACT": 7}, "COM_OBL_RC_ACT: 7, then: disarm: the motors stop in the air"),
        ({"COM_OF_LOSS_T": 0.01}, "COM_OF_LOSS_T: 0.01 s without a setpoint"),
    ],
)
def test_a_refusal_refuses_the_flight_with_reason_and_remedy(bench, parameters, text):
    setting = Setting(bench)
    flown = bench.fly(parameters=parameters)
    assert flown.outcome.outcome == "refused"
    assert text in flown.outcome.note
    assert not flown.was_armed
    assert setting.set == []
    assert not restore_file(flown).exists()


def test_what_a_person_accepts_is_a_warning(bench):
    flown = bench.fly(
        parameters={"COM_OBL_RC_ACT": 6}, settings={"preflight.accept": "[COM_OBL_RC_ACT]"}
    )
    assert flown.outcome.outcome == "landed"
    assert len(flown.told("COM_OBL_RC_ACT: 6, then: terminate")) == 1


def test_a_thrust_field_of_another_meaning_than_wanted_refuses(bench):
    options = {"autopilot": "ardupilot"}
    flown = bench.fly(options=options, settings={"preflight.thrust_field": "thrust"})
    assert flown.outcome.outcome == "refused"
    assert "Thrust is wanted (preflight.thrust_field). Set 8." in flown.outcome.note


@pytest.mark.parametrize(
    ("autopilot", "parameters", "names"),
    [("px4", UNFIXED, ["COM_OF_LOSS_T"]), ("ardupilot", {}, AS_SHIPPED)],
)
def test_fix_sets_on_the_ground_and_sets_back_after_landing(bench, autopilot, parameters, names):
    setting = Setting(bench)
    flown = bench.fly(options={"autopilot": autopilot}, parameters=parameters, settings=FIX)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert setting.set == [*names, *reversed(names)]
    assert not any(setting.armed)
    assert all(setting.listed)
    assert not restore_file(flown).exists()
    for name in names:
        (set_at,) = flown.told(f"set {name}")
        (restored_at,) = flown.told(f"restored {name}")
        severities = [s for _, s, t in flown.seen.messages if f"set {name}" in t]
        assert severities == ["warning"]  # shown without --verbose
        assert set_at < flown.began("arm") < flown.began("land") < restored_at


def test_fix_can_change_what_the_thrust_field_means_before_the_flight_is_flown_so(bench):
    settings = FIX | {"preflight.thrust_field": "thrust"}
    flown = bench.fly(options={"autopilot": "ardupilot"}, settings=settings)
    assert flown.outcome.outcome == "landed"
    assert flown.outcome.completed
    assert flown.told("set GUID_OPTIONS from 0 to 8")
    assert flown.told("restored GUID_OPTIONS from 8 to 0")


def test_what_cannot_be_mended_refuses_before_anything_is_set(bench):
    setting = Setting(bench)
    settings = FIX | {"preflight.thrust_field": "climb_rate"}
    flown = bench.fly(parameters=UNFIXED, settings=settings)
    assert flown.outcome.outcome == "refused"
    assert "a climb rate is wanted" in flown.outcome.note
    assert setting.set == []
    assert not restore_file(flown).exists()


def test_after_an_abort_what_was_set_is_set_back_once_the_vehicle_stands(bench):
    setting = Setting(bench)
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    flown = bench.fly(parameters=UNFIXED, settings=FIX)
    assert flown.outcome.outcome == "aborted"
    assert flown.wire.armed[-1][1] is False
    assert setting.set == ["COM_OF_LOSS_T"] * 2
    assert flown.told("restored COM_OF_LOSS_T from 1 to 8")
    assert not restore_file(flown).exists()


def test_after_a_refusal_of_arming_what_was_set_is_set_back(bench):
    setting = Setting(bench)

    def deny(packet):
        if packet.message_id == MessageId.COMMAND_LONG and packet.fields(_COMMAND)[7] == 400:
            denied = _ACK.pack(400, 1, 0, 0, 1, 191)
            bench.wire.send_to_companion(Outgoing(MessageId.COMMAND_ACK, denied))
            return b""
        return setting.take(packet)

    bench.wire.to_shim = deny
    flown = bench.fly(parameters=UNFIXED, settings=FIX)
    assert flown.outcome.outcome == "refused"
    assert "Arming was denied" in flown.outcome.note
    assert setting.set == ["COM_OF_LOSS_T"] * 2
    assert not restore_file(flown).exists()


def test_where_it_cannot_be_set_back_the_list_stays_and_it_is_said(bench):
    bench.after("track", 1.0, lambda: bench.wire.cut(None))
    flown = bench.fly(
        parameters=UNFIXED,
        settings=FIX | {"timeouts.link_lost_s": "2", "timeouts.handed_over_s": "5"},
    )
    assert flown.outcome.outcome == "aborted"
    listed = read_restore_file(restore_file(flown))
    assert [(c.name, c.old, c.new) for c in listed.changes] == [("COM_OF_LOSS_T", 8.0, 1.0)]
    assert any("--restore" in text for _, _, text in flown.seen.messages)


def test_a_vehicle_left_armed_keeps_what_was_set(bench):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    parameters = UNFIXED | {"COM_OBL_RC_ACT": 5}
    settings = FIX | {"timeouts.handed_over_s": "3"}
    flown = bench.fly(parameters=parameters, settings=settings)
    assert flown.outcome.outcome == "aborted"
    assert flown.wire.armed[-1][1] is True
    assert flown.told("not restored while the vehicle is armed")
    assert restore_file(flown).exists()


def test_a_parameter_that_cannot_be_set_refuses_the_flight(bench):
    def lose_it(packet):
        return b"" if packet.message_id == MessageId.PARAM_SET else packet.raw

    bench.wire.to_shim = lose_it
    flown = bench.fly(parameters=UNFIXED, settings=FIX)
    assert flown.outcome.outcome == "refused"
    assert "COM_OF_LOSS_T could not be set" in flown.outcome.note
    assert not flown.was_armed
    assert not restore_file(flown).exists()  # it was as it should be, so nothing is left to do


def test_a_list_of_an_earlier_flight_is_not_written_over(bench):
    (bench.folder / "flight").mkdir()
    (bench.folder / "flight" / RESTORE_NAME).write_text("{}")
    setting = Setting(bench)
    flown = bench.fly(parameters=UNFIXED, settings=FIX)
    assert flown.outcome.outcome == "refused"
    assert "wait to be restored" in flown.outcome.note
    assert setting.set == []


def test_a_flight_that_begins_in_the_air_is_not_checked(bench):
    flown = bench.fly(airborne=True, parameters={"COM_OBL_RC_ACT": 7})
    assert flown.outcome.outcome == "tracked"


def test_with_fix_a_dead_companion_is_caught_by_ardupilot(tmp_path):
    """Without it, the vehicle flies on, levels, and drifts for as long as anybody looks."""
    modes = {}
    for fixed in (True, False):
        folder = tmp_path / str(fixed)
        folder.mkdir()
        bench = Bench(folder)

        def die(bench=bench):
            bench.wire.to_shim = lambda packet: b""

        bench.after("track", 1.0, die)
        settings = {"timeouts.handed_over_s": "20", "preflight.fix": str(fixed).lower()}
        with suppress(AssertionError):  # setpoints that never arrive may be of any age
            flown = bench.fly(options={"autopilot": "ardupilot"}, settings=settings, check=False)
        modes[fixed] = [name for _, name in flown.wire.modes]
    assert "land" in modes[True]
    assert "land" not in modes[False]
