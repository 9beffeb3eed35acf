import asyncio

import pytest

from companion.link.memory import MemoryLink


@pytest.fixture
def delivered():
    return []


@pytest.fixture
def heard():
    return []


@pytest.fixture
def link(delivered, heard):
    link = MemoryLink(delivered.append)
    link.on_bytes = lambda data, time_s: heard.append((data, time_s))
    return link


async def test_bytes_go_both_ways_in_order_with_the_loops_time(link, delivered, heard):
    await link.open()
    before_s = asyncio.get_running_loop().time()

    link.send(b"1")
    link.send(b"22")
    link.receive(b"3")

    assert delivered == [b"1", b"22"]
    assert [data for data, _ in heard] == [b"3"]
    assert before_s <= heard[0][1] <= asyncio.get_running_loop().time()
    assert (link.counters.packets_out, link.counters.bytes_out) == (2, 3)
    assert (link.counters.packets_in, link.counters.bytes_in) == (1, 1)


async def test_a_closed_end_sends_and_hears_nothing(link, delivered, heard):
    await link.open()
    link.close()
    link.close()

    link.send(b"1")
    link.receive(b"2")

    assert (delivered, heard) == ([], [])
    assert link.counters.unsent_packets == 1
    assert link.counters.foreign_packets == 1
