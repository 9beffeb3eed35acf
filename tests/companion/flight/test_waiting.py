"""Waiting: ended by conditions, time, failures and interruptions, and by errors in any of them."""

import asyncio

import pytest

from companion.flight.clock import run_in_virtual_time
from companion.flight.errors import FlightAbortedError, LinkLostError
from companion.flight.vehicle.waiting import Waiting


def run(scenario):
    """Run a scenario on a Waiting; give what it returns and the time at its end."""

    async def main():
        result = await scenario(Waiting(), asyncio.get_running_loop())
        return result, asyncio.get_running_loop().time()

    return run_in_virtual_time(main())


def test_a_condition_that_holds_needs_no_waiting():
    async def scenario(waiting, loop):
        await waiting.until(lambda: True, 0.0, lambda: "never")

    assert run(scenario)[1] == 0.0


def test_a_condition_is_looked_at_when_something_has_come():
    async def scenario(waiting, loop):
        come = []
        loop.call_later(1.0, come.append, 1)
        loop.call_later(2.0, waiting.wake)
        await waiting.until(lambda: bool(come), 10.0, lambda: "never")

    assert run(scenario)[1] == pytest.approx(2.0)


def test_a_time_out_says_what_is_missing():
    async def scenario(waiting, loop):
        with pytest.raises(FlightAbortedError, match="no bread"):
            await waiting.until(lambda: False, 3.0, lambda: "no bread")

    assert run(scenario)[1] == pytest.approx(3.0)


def test_a_pause_lets_time_pass():
    async def scenario(waiting, loop):
        loop.call_later(0.5, waiting.wake)
        await waiting.pause(2.0)

    assert run(scenario)[1] == pytest.approx(2.0)


@pytest.mark.parametrize("wait", ["until", "pause"])
def test_a_failure_ends_every_wait_present_and_coming(wait):
    async def scenario(waiting, loop):
        def begin():
            if wait == "pause":
                return waiting.pause(9.0)
            return waiting.until(lambda: False, None, lambda: "")

        loop.call_later(1.0, waiting.fail, LinkLostError("gone"))
        loop.call_later(1.0, waiting.fail, FlightAbortedError("what came after"))
        for _ in range(2):
            with pytest.raises(LinkLostError, match="gone"):
                await begin()
        with pytest.raises(LinkLostError):
            waiting.check()

    assert run(scenario)[1] == pytest.approx(1.0)


def test_an_interruption_ends_a_wait_and_only_that():
    async def scenario(waiting, loop):
        errors = [KeyError("stop")]
        waiting.interruption = lambda: errors.pop() if errors and loop.time() >= 1.0 else None
        loop.call_later(1.0, waiting.wake)
        with pytest.raises(KeyError):
            await waiting.pause(9.0)
        await waiting.pause(1.0)

    assert run(scenario)[1] == pytest.approx(2.0)


def test_a_condition_that_raises_ends_its_own_wait_and_no_other():
    async def scenario(waiting, loop):
        def broken():
            if loop.time() > 0.5:
                raise ZeroDivisionError
            return False

        other = loop.create_task(waiting.pause(3.0))
        loop.call_later(1.0, waiting.wake)  # would be swallowed by the loop if it raised
        with pytest.raises(ZeroDivisionError):
            await waiting.until(broken, 9.0, lambda: "")
        await other

    assert run(scenario)[1] == pytest.approx(3.0)


def test_a_condition_may_wake_the_waiting_itself():
    async def scenario(waiting, loop):
        errors = []

        def condition():
            if loop.time() > 0.5 and not errors:
                errors.append(KeyError("stop"))
                waiting.interruption = lambda: errors[0]
                waiting.wake()
            return False

        loop.call_later(1.0, waiting.wake)
        with pytest.raises(KeyError):
            await waiting.until(condition, 9.0, lambda: "")

    assert run(scenario)[1] == pytest.approx(1.0)
