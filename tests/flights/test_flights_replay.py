"""A recorded flight's inputs give its setpoints again, bit for bit."""

import json
import re
import shutil

import pytest

from companion.commands.recover import RecoverRequest, run_recover
from companion.commands.replay import BadInputError, ReplayRequest, run_replay
from companion.flight.inbox import PilotCommand
from companion.flight.replay.recorded import ReplayError, read_flight
from companion.mavlink.codec import Packer
from companion.mavlink.messages import MessageId, Outgoing
from companion.recording.tlog import TlogWriter, read_tlog

CLIENT = Packer(255, 190)
STATE = (MessageId.ODOMETRY, MessageId.LOCAL_POSITION_NED)


def replayed(folder, capsys, **options):
    code = run_replay(ReplayRequest(folder, options.pop("controller", None), True, **options))
    return code, json.loads(capsys.readouterr().out)


def lose_state_for(bench, seconds):
    def lose(packet):
        return b"" if packet.message_id in STATE else packet.raw

    def begin():
        bench.wire.from_shim = lose
        bench.wire.restore_after(seconds)

    return begin


def sent(folder):
    packets = read_tlog(folder / "flight.tlog")
    return [p for p in packets if p.sent and p.raw[7] == MessageId.SET_ATTITUDE_TARGET]


def test_each_setpoint_is_the_same_through_silence_a_hand_over_and_a_resumption(bench, capsys):
    bench.after("track", 0.5, lose_state_for(bench, 0.3))
    bench.after("track", 1.5, lambda: bench.inbox.put(PilotCommand.ABORT))
    bench.after("handed over", 3.0, lambda: bench.inbox.put(PilotCommand.RESUME))
    flown = bench.fly()
    assert flown.outcome.outcome == "landed"
    phases = {r.values["phase"] for r in flown.records("control")}
    assert {"silence", "track"} <= phases
    code, record = replayed(flown.folder, capsys)
    assert code == 0
    assert record["setpoints"] == record["identical"] == len(sent(flown.folder)) > 1000
    assert record["unmatched"] == 0
    assert record["differs_in"] == {}
    assert (flown.folder / "replay.png").stat().st_size > 10_000


def test_each_setpoint_is_the_same_on_ardupilot_with_what_holds_it_while_it_brakes(bench, capsys):
    bench.after("track", 1.0, lambda: bench.inbox.put(PilotCommand.ABORT))
    bench.after("handed over", 3.0, lambda: bench.inbox.put(PilotCommand.LAND))
    flown = bench.fly(options={"autopilot": "ardupilot", "vehicle": "arducopter"})
    assert flown.outcome.outcome == "landed"
    kinds = [r.values["kind"] for r in flown.records("input")]
    assert "hold" in kinds
    code, record = replayed(flown.folder, capsys)
    assert (code, record["unmatched"]) == (0, 0)
    assert record["setpoints"] == record["identical"] == len(sent(flown.folder)) > 300


def test_hand_overs_between_controllers_come_again_and_another_controller_differs(bench, capsys):
    settings = {"setpoint": "rates"}
    options = {"controller": "mpc-l1-plus", "switch": ["t=1:mpc-l1", "t=2:l1-off"]}
    flown = bench.fly(options=options, settings=settings, check=False)
    assert flown.outcome.outcome == "landed"
    assert len(flown.outcome.changes) == 2
    code, record = replayed(flown.folder, capsys)
    assert code == 0
    assert record["identical"] == len(sent(flown.folder)) > 500

    code, record = replayed(flown.folder, capsys, controller="lqr-l1", out=flown.folder / "lqr")
    assert code == 0  # a question, not a check
    assert record["replayed"] == "lqr-l1"
    assert record["identical"] < record["setpoints"]
    assert record["rate_rms_deg_s"] > 0.1
    assert (flown.folder / "lqr" / "replay.json").exists()

    # A log that was cut off, as by kill -9, is replayed as far as it goes.
    cut = flown.folder.parent / "cut"
    cut.mkdir()
    for name, share in (("flight.mcap", 0.5), ("flight.tlog", 0.9)):
        data = (flown.folder / name).read_bytes()
        (cut / name).write_bytes(data[: int(share * len(data))])
    _, record = replayed(cut, capsys)
    assert record["setpoints"] == record["identical"] > 100

    # What was recovered of it is replayed, whatever has become of the original.
    assert run_recover(RecoverRequest(cut)) == 0
    (cut / "flight.mcap").write_bytes(b"damaged")
    capsys.readouterr()
    _, again = replayed(cut / "flight.recovered.mcap", capsys)
    assert (again["setpoints"], again["identical"]) == (record["setpoints"], record["identical"])


def test_a_setpoint_that_is_another_and_a_sample_that_is_missing_are_found(bench, capsys):
    folder = bench.fly().folder
    forged = folder.parent / "forged"
    shutil.copytree(folder, forged)
    (forged / "flight.tlog").unlink()
    log = TlogWriter(forged / "flight.tlog")
    count, lost = 0, 0
    for packet in read_tlog(folder / "flight.tlog"):
        raw = packet.raw
        if packet.sent and raw[7] == MessageId.SET_ATTITUDE_TARGET:
            count += 1
            if count == 500:
                raw = with_another_bit(raw)
        if count == 700 and not packet.sent and is_odometry(raw) and not lost:
            lost += 1
            continue
        log.write(packet.time_us * 1e-6, raw, sent=packet.sent)
        if count == 300 and packet.sent:
            # A client's, passed on: not the companion's doing, and nothing to be compared.
            log.write(packet.time_us * 1e-6, CLIENT.pack(Outgoing(raw[7], raw[10:-2])), sent=True)
    log.close()
    code, record = replayed(forged, capsys)
    assert code == 1
    assert record["unmatched"] == 1
    # The one that was changed, and those after the sample that is missing, which the laws feel.
    assert 1 < record["setpoints"] - record["identical"] < record["setpoints"] - 600
    assert record["first_difference_s"] is not None


def with_another_bit(raw):
    from tests.flights.wire import Packet

    packet = Packet(0.0, raw)
    payload = bytearray(packet.payload)
    payload[12] ^= 1
    return packet.with_payload(bytes(payload))


def is_odometry(raw):
    return int.from_bytes(raw[7:10], "little") == MessageId.ODOMETRY and raw[6] == 1


@pytest.mark.parametrize("damage", ["nothing there", "no mcap", "no tlog", "no configuration"])
def test_what_cannot_be_replayed_is_refused_by_name(tmp_path, damage):
    folder = tmp_path / "flight"
    if damage != "nothing there":
        folder.mkdir()
    if damage in ("no tlog", "no configuration"):
        from companion.recording.mcap_log import McapLog

        McapLog(folder / "flight.mcap").close()
    if damage == "no mcap":
        TlogWriter(folder / "flight.tlog").close()
    with pytest.raises(ReplayError, match=r"flight\.(mcap|tlog): "):
        read_flight(folder)
    with pytest.raises(BadInputError):
        run_replay(ReplayRequest(folder, None, False))


@pytest.mark.parametrize(
    ("named", "there", "read"),
    [
        ("", ["flight"], "flight.mcap"),
        ("", ["flight", "flight.recovered"], "flight.recovered.mcap"),
        ("flight.mcap", ["flight", "flight.recovered"], "flight.mcap"),
        ("flight.recovered.mcap", ["flight", "flight.recovered"], "flight.recovered.mcap"),
        ("flight.recovered.tlog", ["flight", "flight.recovered"], "flight.recovered.mcap"),
        ("flight.recovered.tlog", ["flight"], "flight.mcap"),
        ("saved.tlog", ["flight", "saved"], "saved.mcap"),
        ("saved.tlog", ["flight"], "flight.mcap"),
    ],
)
def test_the_file_that_is_named_is_read_and_in_a_folder_what_was_recovered(
    tmp_path, named, there, read
):
    """By which file is told to hold no configuration."""
    from companion.recording.mcap_log import McapLog

    for stem in there:
        McapLog(tmp_path / f"{stem}.mcap").close()
    for name in ("flight.tlog", "flight.recovered.tlog", "saved.tlog"):
        TlogWriter(tmp_path / name).close()
    with pytest.raises(ReplayError, match=f"^{re.escape(str(tmp_path / read))}: does not say"):
        read_flight(tmp_path / named)


@pytest.mark.parametrize(
    ("named", "there", "read"),
    [
        ("", ["flight", "flight.recovered"], "flight.recovered.tlog"),
        ("flight.mcap", ["flight", "flight.recovered"], "flight.tlog"),
        ("flight.recovered.mcap", ["flight", "flight.recovered"], "flight.recovered.tlog"),
        ("flight.recovered.mcap", ["flight"], "flight.tlog"),
    ],
)
def test_the_packets_are_those_that_go_with_it(tmp_path, named, there, read):
    """By which file is told to be none."""
    from companion.recording.mcap_log import McapLog

    for name in ("flight.mcap", "flight.recovered.mcap"):
        McapLog(tmp_path / name).close()
    for stem in there:
        (tmp_path / f"{stem}.tlog").write_bytes(b"no packet at all, for certain")
    with pytest.raises(ReplayError, match=f"^{re.escape(str(tmp_path / read))}: no MAVLink"):
        read_flight(tmp_path / named)
