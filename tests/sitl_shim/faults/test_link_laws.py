"""What holds of every fault of a link, whatever its numbers and whatever passes."""

from itertools import pairwise
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st

from sitl_shim.faults.link import link_faults
from sitl_shim.faults.schema import Faults
from sitl_shim.wind.events import Moments
from tests.sitl_shim.faults.link_traffic import Sent, carried, way_of

_NANOSECOND_S = 1e-9
_LAW = settings(deadline=None, derandomize=True, max_examples=60)

_seconds = st.floats(0.0, 0.3)
_shares = st.floats(0.0, 1.0)
_traffic = st.lists(st.tuples(st.floats(0.0, 0.2), st.integers(4, 280)), min_size=1, max_size=60)

_harmless = st.fixed_dictionaries(
    {"delay_s": _seconds, "jitter_s": _seconds, "reorder": _shares, "keep_order": st.booleans()},
    optional={"reorder_by_s": st.floats(0.001, 0.2), "until_s": st.floats(1.0, 3.0)},
)
_anything = st.fixed_dictionaries(
    {},
    optional={
        "from_s": _seconds,
        "until_s": st.floats(0.5, 3.0),
        "loss": _shares,
        "bursts": st.fixed_dictionaries(
            {"every_s": st.floats(0.01, 1.0), "length_s": st.floats(0.01, 1.0)}
        ),
        "delay_s": _seconds,
        "jitter_s": _seconds,
        "keep_order": st.booleans(),
        "duplicate": _shares,
        "reorder": _shares,
        "corrupt": _shares,
        "bandwidth_bytes_s": st.floats(100.0, 10_000.0),
        "queue_bytes": st.floats(1.0, 2_000.0),
        "pause": st.booleans(),
        "babble_packets_s": st.sampled_from([0.0, 3.0, 40.0, 2000.0]),
    },
).map(lambda fault: {**fault, "until_s": fault.get("until_s", 2.0)})


def _sent(traffic: list[tuple[float, int]]) -> list[Sent]:
    """Datagrams of these sizes, so much after one another; all differ."""
    time_s, sent = 0.0, []
    for number, (after_s, size) in enumerate(traffic):
        time_s += after_s
        sent.append((time_s, number.to_bytes(4, "little") + bytes(size - 4)))
    return sent


@given(_harmless, _traffic)
@_LAW
def test_nothing_is_lost_made_up_early_or_held_for_longer_than_it_says(
    fault: dict[str, Any], traffic: list[tuple[float, int]]
) -> None:
    sent = _sent(traffic)
    arrived = carried(way_of(fault), sent)
    assert sorted(data for _, data in arrived) == sorted(data for _, data in sent)
    at_s = {data: time_s for time_s, data in sent}
    longest_s = fault["delay_s"] + fault["jitter_s"] + fault.get("reorder_by_s", 0.025)
    for due_s, data in arrived:
        assert -_NANOSECOND_S <= due_s - at_s[data] <= longest_s + _NANOSECOND_S


@given(_anything, _traffic)
@_LAW
def test_where_order_is_kept_nothing_overtakes(
    fault: dict[str, Any], traffic: list[tuple[float, int]]
) -> None:
    fault = {**fault, "keep_order": True, "reorder": 0.0, "corrupt": 0.0, "babble_packets_s": 0.0}
    arrived = [data for _, data in carried(way_of(fault), _sent(traffic))]
    assert arrived == sorted(arrived, key=lambda data: data[:4][::-1])


@given(st.lists(_anything, min_size=1, max_size=3), _traffic)
@_LAW
def test_arrivals_are_told_in_the_order_of_their_times(
    faults: list[dict[str, Any]], traffic: list[tuple[float, int]]
) -> None:
    arrived = carried(way_of(*faults), _sent(traffic))
    assert all(earlier[0] <= later[0] for earlier, later in pairwise(arrived))


@given(st.lists(_anything, min_size=1, max_size=3), _traffic, st.lists(st.floats(0.0, 5.0)))
@_LAW
def test_it_does_not_matter_when_one_looks(
    faults: list[dict[str, Any]], traffic: list[tuple[float, int]], looks_s: list[float]
) -> None:
    sent = _sent(traffic)
    at_once = carried(way_of(*faults), sent)
    bit_by_bit = carried(way_of(*faults), sent, looks_s=looks_s)
    assert sorted(at_once) == sorted(bit_by_bit)
    assert [due_s for due_s, _ in at_once] == [due_s for due_s, _ in bit_by_bit]


@given(st.lists(_anything, min_size=1, max_size=3), _traffic, st.integers(0, 3))
@_LAW
def test_the_same_seed_gives_the_same_arrivals(
    faults: list[dict[str, Any]], traffic: list[tuple[float, int]], seed: int
) -> None:
    sent = _sent(traffic)
    assert carried(way_of(*faults, seed=seed), sent) == carried(way_of(*faults, seed=seed), sent)


@given(st.lists(_anything, min_size=1, max_size=3), _traffic)
@_LAW
def test_before_its_time_a_fault_does_nothing(
    faults: list[dict[str, Any]], traffic: list[tuple[float, int]]
) -> None:
    waiting = [{**fault, "from_s": 100.0, "until_s": 200.0} for fault in faults]
    sent = _sent(traffic)
    way = way_of(*waiting)
    for time_s, data in sent:
        way.send(0, data, time_s)
    assert [(due_s, data) for due_s, _, data in way.arrived(99.0)] == sent


@given(st.floats(100.0, 10_000.0), st.floats(1.0, 3_000.0), _traffic)
@_LAW
def test_no_more_passes_than_the_bandwidth_and_no_more_waits_than_the_queue_holds(
    bandwidth_bytes_s: float, queue_bytes: float, traffic: list[tuple[float, int]]
) -> None:
    sent = _sent(traffic)
    fault = {"bandwidth_bytes_s": bandwidth_bytes_s, "queue_bytes": queue_bytes}
    arrived = carried(way_of(fault), sent)
    for (before_s, _), (due_s, data) in pairwise(arrived):
        assert due_s - before_s >= len(data) / bandwidth_bytes_s - _NANOSECOND_S
    due_of = {data: due_s for due_s, data in arrived}
    assert sent[0][1] in due_of  # an idle link takes any datagram
    for time_s, data in sent:
        waiting_bytes = max(
            [0.0, *((due_s - time_s) * bandwidth_bytes_s for other, due_s in due_of.items()
                    if other[:4][::-1] < data[:4][::-1])]
        )  # fmt: skip
        fits = waiting_bytes + len(data)
        if data in due_of:
            assert waiting_bytes <= _NANOSECOND_S or fits <= queue_bytes + 1e-6
        else:
            assert fits > queue_bytes - 1e-6


@given(_anything, _traffic)
@_LAW
def test_the_truth_and_whatever_else_passes_by_arrives_as_it_was_sent(
    fault: dict[str, Any], traffic: list[tuple[float, int]]
) -> None:
    way = way_of({**fault, "babble_packets_s": 0.0, "pause": True, "until_s": None})
    sent = [(fault.get("from_s", 0.0) + time_s, data) for time_s, data in _sent(traffic)]
    for time_s, data in sent:
        way.pass_by(0, data, time_s)
        way.send(0, b"paused", time_s)
    assert [(due_s, data) for due_s, _, data in way.arrived(1e9)] == sent


@given(_anything)
@_LAW
def test_a_fault_acts_in_its_own_direction_alone(fault: dict[str, Any]) -> None:
    for way, other in (("telemetry", "setpoints"), ("setpoints", "telemetry")):
        model = Faults.model_validate({"link": ({**fault, "way": way},)})
        found = link_faults(model, Moments(), seed=1, links=1, babble=lambda _: (b"",))
        assert getattr(found, way) is not None
        assert getattr(found, other) is None
