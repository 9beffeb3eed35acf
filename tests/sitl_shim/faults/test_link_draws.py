"""The faults of a link that are drawn: as often as they say, and each by itself."""

from itertools import pairwise
from math import sqrt
from typing import Any

import pytest

from tests.sitl_shim.faults.link_traffic import carried, number_of, numbered, way_of

_COUNT = 20_000
_SENT = numbered(_COUNT)


def _within_five_sigma(hits: int, share: float, count: int = _COUNT) -> bool:
    return abs(hits - share * count) < 5.0 * sqrt(share * (1.0 - share) * count)


def _arrived(*faults: dict[str, Any], **how: Any) -> list[tuple[float, bytes]]:
    return carried(way_of(*faults, **how), _SENT)


def _lost(*faults: dict[str, Any], **how: Any) -> set[int]:
    return set(range(_COUNT)) - {number_of(data) for _, data in _arrived(*faults, **how)}


def _damaged(*faults: dict[str, Any]) -> set[bytes]:
    whole = {data for _, data in _SENT}
    return {data for _, data in _arrived(*faults) if data not in whole}


def _twice(*faults: dict[str, Any]) -> set[bytes]:
    seen: set[bytes] = set()
    again: set[bytes] = set()
    for _, data in _arrived(*faults):
        (again if data in seen else seen).add(data)
    return again


@pytest.mark.parametrize("share", [0.01, 0.3, 0.9])
def test_as_many_are_lost_doubled_damaged_and_overtaken_as_it_says(share: float) -> None:
    assert _within_five_sigma(len(_lost({"loss": share})), share)
    assert _within_five_sigma(len(_twice({"duplicate": share})), share)
    assert _within_five_sigma(len(_damaged({"corrupt": share})), share)
    late = [
        data
        for due_s, data in _arrived({"reorder": share})
        if due_s > 0.01 * number_of(data) + 0.02
    ]
    assert _within_five_sigma(len(late), share)


def test_a_share_of_nothing_and_of_all() -> None:
    assert _arrived({}) == _SENT
    assert _arrived({"loss": 1.0}) == []
    assert _arrived({"pause": True}) == []
    assert len(_arrived({"duplicate": 1.0})) == 2 * _COUNT


def test_losses_come_by_themselves() -> None:
    lost = _lost({"loss": 0.3})
    both = sum(number in lost and number + 1 in lost for number in range(_COUNT - 1))
    assert _within_five_sigma(both, 0.09)


def test_what_is_damaged_has_one_to_three_other_bytes_and_its_length() -> None:
    changes = {0: 0, 1: 0, 2: 0, 3: 0}
    for (_, sent), (_, got) in zip(_SENT, _arrived({"corrupt": 1.0}), strict=True):
        assert len(got) == len(sent)
        changes[sum(before != after for before, after in zip(sent, got, strict=True))] += 1
    assert changes[0] == 0
    assert all(_within_five_sigma(changes[count], 1.0 / 3.0) for count in (1, 2, 3))


def test_short_datagrams_can_be_damaged_too() -> None:
    sent = [(0.1 * size, bytes(size)) for size in range(5)]
    got = [data for _, data in carried(way_of({"corrupt": 1.0}), sent)]
    assert [len(data) for data in got] == [0, 1, 2, 3, 4]
    assert all(any(data) for data in got[1:])


def test_the_delay_is_spread_evenly_over_its_range() -> None:
    fault = {"delay_s": 0.1, "jitter_s": 0.05, "keep_order": False}
    delays_s = [due_s - 0.01 * number_of(data) for due_s, data in _arrived(fault)]
    assert min(delays_s) >= 0.05 - 1e-9
    assert max(delays_s) <= 0.15 + 1e-9
    for quarter in range(4):
        low_s = 0.05 + 0.025 * quarter
        assert _within_five_sigma(sum(low_s <= d < low_s + 0.025 for d in delays_s), 0.25)


def test_order_is_lost_where_it_need_not_be_kept() -> None:
    fault = {"delay_s": 0.02, "jitter_s": 0.02}
    kept = [number_of(data) for _, data in _arrived(fault)]
    loose = [number_of(data) for _, data in _arrived({**fault, "keep_order": False})]
    assert kept == sorted(kept)
    assert loose != sorted(loose)


def test_what_is_held_back_holds_up_nothing_else() -> None:
    fault = {"reorder": 0.1, "reorder_by_s": 0.035}
    moved = {round(due_s - 0.01 * number_of(data), 9) for due_s, data in _arrived(fault)}
    assert moved == {0.0, 0.035}


# --- bursts ---

_BURSTS = {"bursts": {"every_s": 3.0, "length_s": 0.2}}


def _silences_s(*faults: dict[str, Any]) -> list[float]:
    """Their lengths, from datagrams each 10 ms."""
    times_s = [due_s for due_s, _ in carried(way_of(*faults), numbered(200_000))]
    return [later - earlier for earlier, later in pairwise(times_s) if later - earlier > 0.015]


def test_bursts_are_as_long_and_as_frequent_as_they_say() -> None:
    silences_s = _silences_s(_BURSTS)
    # 2000 s at one each 3.2 s; a few are too short to be seen between two datagrams.
    assert 540 < len(silences_s) < 690
    mean_s = sum(silences_s) / len(silences_s)
    assert mean_s == pytest.approx(0.21, rel=0.2)
    assert sum(silence_s > 0.4 for silence_s in silences_s) > 0.05 * len(silences_s)


def test_bursts_come_at_the_same_times_whatever_passes() -> None:
    dense = {number_of(data) for _, data in carried(way_of(_BURSTS), numbered(20_000))}
    sparse = {
        5 * number_of(data) for _, data in carried(way_of(_BURSTS), numbered(4_000, every_s=0.05))
    }
    assert sparse == {number for number in dense if number % 5 == 0}


# --- each by itself ---


def test_one_thing_of_a_fault_is_drawn_independently_of_the_others() -> None:
    rest = {"loss": 0.2, "jitter_s": 0.001, "reorder": 0.1, **_BURSTS}
    lost = _lost({"loss": 0.2})
    assert _lost({"loss": 0.2, "duplicate": 0.5, "jitter_s": 0.01, "reorder": 0.3}) == lost
    assert _twice({"duplicate": 0.3, **rest}) <= _twice({"duplicate": 0.3})
    assert lost <= _lost({**rest})
    delayed = {"jitter_s": 0.01, "delay_s": 0.02, "keep_order": False}
    once, doubled = _arrived(delayed), _arrived({**delayed, "duplicate": 0.5})
    assert set(once) < set(doubled)  # second copies come on top, and move nothing


def test_one_fault_is_drawn_independently_of_the_others() -> None:
    lossy = {"loss": 0.2, "from_s": 100.0}
    others = ({"loss": 0.5, "until_s": 100.0}, {"duplicate": 0.5, "until_s": 99.0})
    of_the_first_half = set(range(10_000))
    # Its place in the file is part of its seed.
    assert _lost(others[0], lossy, others[1]) - of_the_first_half == _lost({}, lossy)
    assert _lost({}, lossy) != _lost(lossy)


def test_seeds_directions_links_and_places_draw_by_themselves() -> None:
    fault = {"loss": 0.5}
    two = way_of(fault, links=2)
    drawn = [
        _lost(fault),
        _lost(fault, seed=2),
        _lost(fault, way="setpoints"),
        _lost({}, fault),
        set(range(_COUNT)) - {number_of(data) for _, data in carried(two, _SENT, link=1)},
    ]
    for one, other in pairwise([*drawn, drawn[0]]):
        assert _within_five_sigma(len(one & other), 0.25)
    assert (
        set(range(_COUNT))
        - {number_of(data) for _, data in carried(way_of(fault, links=2), _SENT, link=0)}
    ) == drawn[0]
