import asyncio

from companion.link.memory import MemoryLink, memory_pair


async def opened_pair():
    left, right = memory_pair()
    heard = {"left": [], "right": []}
    left.on_bytes = lambda data, time_s: heard["left"].append((data, time_s))
    right.on_bytes = lambda data, time_s: heard["right"].append((data, time_s))
    await left.open()
    await right.open()
    return left, right, heard


async def test_bytes_go_both_ways_in_order_with_the_loops_time():
    left, right, heard = await opened_pair()

    left.send(b"1")
    left.send(b"2")
    right.send(b"3")
    await asyncio.sleep(0)

    assert [data for data, _ in heard["right"]] == [b"1", b"2"]
    assert [data for data, _ in heard["left"]] == [b"3"]
    now_s = asyncio.get_running_loop().time()
    assert 0 <= now_s - heard["left"][0][1] < 10
    assert (left.counters.packets_out, right.counters.packets_in) == (2, 2)
    assert (right.counters.bytes_out, left.counters.bytes_in) == (1, 1)


async def test_nothing_arrives_within_the_send_itself():
    left, _, heard = await opened_pair()

    left.send(b"1")

    assert heard["right"] == []


async def test_a_closed_end_sends_and_hears_nothing():
    left, right, heard = await opened_pair()
    right.close()
    right.close()

    left.send(b"1")
    right.send(b"2")
    await asyncio.sleep(0)

    assert heard == {"left": [], "right": []}
    assert right.counters.unsent_packets == 1
    assert right.counters.foreign_packets == 1


async def test_an_end_hands_its_bytes_to_whoever_is_given():
    delivered = []
    link = MemoryLink(delivered.append)
    heard = []
    link.on_bytes = lambda data, time_s: heard.append(data)
    await link.open()

    link.send(b"out")
    link.receive(b"in")

    assert (delivered, heard) == ([b"out"], [b"in"])
