"""When a fault of a link begins and ends, what of it is left then, and its babble."""

from math import inf

import pytest

from sitl_shim.mavlink.babble import babble_packets
from sitl_shim.mavlink.wire import Parser
from sitl_shim.wind.events import Moments
from tests.sitl_shim.faults.link_traffic import carried, number_of, numbered, way_of


def test_a_fault_acts_from_its_beginning_and_no_more_at_its_end() -> None:
    arrived = carried(way_of({"pause": True, "from_s": 0.3, "until_s": 0.5}), numbered(100))
    assert [number_of(data) for _, data in arrived] == [*range(30), *range(50, 100)]


def test_a_fault_since_setpoints_waits_for_them() -> None:
    moments = Moments()
    fault = {"pause": True, "since": "setpoints", "from_s": 0.095, "until_s": 0.195}
    way = way_of(fault, moments=moments)
    sent = numbered(100)
    got = carried(way, sent[:40], looks_s=[0.395])
    moments.setpoints_s = 0.4
    got += carried(way, sent[40:])
    assert [number_of(data) for _, data in got] == [*range(50), *range(60, 100)]


def test_what_is_still_held_at_the_end_is_not_overtaken() -> None:
    fault = {"delay_s": 0.1, "until_s": 0.5}
    arrived = carried(way_of(fault), numbered(100))
    assert [number_of(data) for _, data in arrived] == list(range(100))
    late_s = {number_of(data): due_s - 0.01 * number_of(data) for due_s, data in arrived}
    assert late_s[49] == pytest.approx(0.1)
    assert late_s[55] == pytest.approx(0.04)  # waits for number 49, which arrives at 0.59 s
    assert late_s[60] == 0.0


def test_without_order_the_end_of_a_delay_lets_later_ones_overtake() -> None:
    fault = {"delay_s": 0.1, "until_s": 0.5, "keep_order": False}
    arrived = [number_of(data) for _, data in carried(way_of(fault), numbered(100))]
    assert arrived[:40] == list(range(40))
    assert set(arrived[40:60]) == {*range(40, 50), *range(50, 60)}
    assert arrived != sorted(arrived)


def test_what_waits_for_the_bandwidth_goes_when_the_limit_is_lifted() -> None:
    fault = {"bandwidth_bytes_s": 120.0, "until_s": 0.5}
    arrived = carried(way_of(fault), numbered(100))
    assert [number_of(data) for _, data in arrived] == list(range(100))
    assert [due_s for due_s, _ in arrived[:4]] == pytest.approx([0.1, 0.2, 0.3, 0.4])
    assert {due_s for due_s, _ in arrived[5:50]} == {0.5}
    assert arrived[51:] == numbered(100)[51:]


def test_a_bandwidth_that_is_too_small_loses_what_its_queue_cannot_hold() -> None:
    fault = {"bandwidth_bytes_s": 600.0, "queue_bytes": 60.0}  # half of what is sent
    sent = numbered(1000)
    arrived = carried(way_of(fault), sent)
    assert len(arrived) == pytest.approx(500, abs=6)
    assert max(due_s - sent[number_of(data)][0] for due_s, data in arrived) <= 0.1 + 1e-9


def test_faults_act_one_after_another() -> None:
    faults = ({"delay_s": 0.2}, {"pause": True, "from_s": 0.3, "until_s": 0.5})
    arrived = carried(way_of(*faults), numbered(100))
    # Sent from 0.1 s on they come to the second one from 0.3 s on.
    assert [number_of(data) for _, data in arrived] == [*range(10), *range(30, 100)]


@pytest.mark.parametrize("rate_hz", [3.0, 70.0, 999.0, 20_000.0])
def test_babble_comes_at_its_rate_and_stops(rate_hz: float) -> None:
    way = way_of({"babble_packets_s": rate_hz, "from_s": 1.0, "until_s": 3.0})
    assert way.next_s == 1.0
    times_s = [due_s for tick in range(1, 1251) for due_s, _, _ in way.arrived(0.004 * tick)]
    # At high rates the last bunch would come at the very end, and does not.
    assert 2.0 * rate_hz - max(1.0, 0.001 * rate_hz) <= len(times_s) <= 2.0 * rate_hz + 1.0
    assert min(times_s) == 1.0
    assert max(times_s) < 3.0
    assert way.next_s == inf
    for second in (1.0, 2.0):
        of_it = sum(second <= time_s < second + 1.0 for time_s in times_s)
        assert of_it == pytest.approx(rate_hz, abs=max(1.0, 0.001 * rate_hz))


def test_babble_comes_on_top_of_what_is_sent_and_goes_on_through_a_pause() -> None:
    sent = numbered(100)
    both = carried(way_of({"babble_packets_s": 50.0, "until_s": 1.0}), sent)
    assert [entry for entry in both if entry[1] != b"babble"] == sent
    assert len(both) == 150
    alone = carried(way_of({"babble_packets_s": 50.0, "until_s": 1.0, "pause": True}), sent)
    assert [data for _, data in alone] == [b"babble"] * 50


def test_babble_competes_for_the_bandwidth() -> None:
    sent = numbered(1000)  # 1200 bytes a second
    tight = {"bandwidth_bytes_s": 1300.0, "queue_bytes": 200.0, "until_s": 10.0}
    assert len(carried(way_of(tight), sent)) == 1000
    hurt = carried(way_of({**tight, "babble_packets_s": 1000.0}), sent)
    assert sum(data != b"babble" for _, data in hurt) < 500


def test_babble_since_setpoints_is_never_of_the_past() -> None:
    moments = Moments()
    fault = {"babble_packets_s": 1000.0, "since": "setpoints", "until_s": 1.0}
    way = way_of(fault, moments=moments)
    assert way.next_s == inf
    assert way.arrived(5.0) == []
    moments.setpoints_s = 4.99
    times_s = [arrival.due_s for arrival in way.arrived(6.0)]
    assert len(times_s) == 1000
    assert min(times_s) == 5.0


def test_babble_is_valid_and_numbered_through() -> None:
    packets = babble_packets(7)
    parser = Parser()
    messages = [message for packet in packets for message in parser.parse(packet)]
    assert len(messages) == len(packets) == 256
    assert [message.get_seq() for message in messages] == list(range(256))
    assert {message.get_srcSystem() for message in messages} == {7}
    assert 240 not in {message.get_srcComponent() for message in messages}
