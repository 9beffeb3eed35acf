"""Simulated time: exact jumps, a fixed order, and no silent deadlock."""

import asyncio
import os
import signal
import time

import pytest

from companion.flight.clock import run_in_virtual_time


def test_time_jumps_to_the_timers():
    async def main():
        loop = asyncio.get_running_loop()
        seen = [loop.time()]
        for pause in (0.01, 1.0, 3600.0, 1e6):
            await asyncio.sleep(pause)
            seen.append(loop.time())
        return seen

    begun = time.perf_counter()
    seen = run_in_virtual_time(main())
    assert seen == pytest.approx([0.0, 0.01, 1.01, 3601.01, 1003601.01], abs=1e-6)
    assert time.perf_counter() - begun < 60.0


def test_timers_run_at_their_times_in_their_order():
    async def main():
        loop = asyncio.get_running_loop()
        ran = []
        for when in (0.3, 0.1, 0.2, 0.1 + 1e-7):
            loop.call_at(when, lambda when=when: ran.append((when, loop.time())))
        await asyncio.sleep(1.0)
        return ran

    ran = run_in_virtual_time(main())
    assert [when for when, _ in ran] == [0.1, 0.1 + 1e-7, 0.2, 0.3]
    for when, at in ran:
        assert at == pytest.approx(when, abs=2e-9)


def test_equal_timers_run_in_the_same_order_each_time():
    async def main():
        loop = asyncio.get_running_loop()
        ran = []
        for name in range(50):
            loop.call_at(0.5 + 0.1 * (name % 3), ran.append, name)
        await asyncio.sleep(1.0)
        return ran

    first = run_in_virtual_time(main())
    assert sorted(first) == list(range(50))
    assert all(run_in_virtual_time(main()) == first for _ in range(3))


def test_what_is_ready_runs_before_time_goes_on():
    async def main():
        loop = asyncio.get_running_loop()
        ran = []

        async def busy():
            for _ in range(1000):
                await asyncio.sleep(0)
            ran.append(("busy", loop.time()))

        loop.call_later(1e-6, lambda: ran.append(("timer", loop.time())))
        await busy()
        await asyncio.sleep(1.0)
        return ran

    assert run_in_virtual_time(main()) == [("busy", 0.0), ("timer", pytest.approx(1e-6))]


def test_time_outs_work():
    async def main():
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(asyncio.get_running_loop().create_future(), 5.0)
        return asyncio.get_running_loop().time()

    assert run_in_virtual_time(main()) == pytest.approx(5.0)


def test_waiting_for_what_can_never_come_is_an_error():
    async def main():
        await asyncio.get_running_loop().create_future()

    with pytest.raises(RuntimeError, match="deadlock in simulated time"):
        run_in_virtual_time(main())


def test_an_error_comes_out():
    async def main():
        await asyncio.sleep(1.0)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_in_virtual_time(main())


def test_a_signal_is_noticed_within_few_rounds_of_the_loop():
    async def main():
        loop = asyncio.get_running_loop()
        came = []
        loop.add_signal_handler(signal.SIGUSR1, came.append, "signal")
        try:
            rounds = []
            for _ in range(3):
                came.clear()
                os.kill(os.getpid(), signal.SIGUSR1)
                count = 0
                while not came and count < 1000:
                    await asyncio.sleep(1.0)
                    count += 1
                rounds.append(count)
        finally:
            loop.remove_signal_handler(signal.SIGUSR1)
        return rounds

    assert max(run_in_virtual_time(main())) < 100


def test_a_signal_ends_a_wait_in_which_nothing_else_can_come():
    async def main():
        loop = asyncio.get_running_loop()
        came = loop.create_future()
        loop.add_signal_handler(signal.SIGUSR1, came.set_result, "signal")
        try:
            os.kill(os.getpid(), signal.SIGUSR1)
            return await came
        finally:
            loop.remove_signal_handler(signal.SIGUSR1)

    assert run_in_virtual_time(main()) == "signal"
