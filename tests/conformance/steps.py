"""Steps that a client takes with an autopilot, and how each of them went."""

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field

FLAVOURS = ("px4", "ardupilot")
TITLES = {"px4": "PX4", "ardupilot": "ArduPilot"}


@dataclass(frozen=True, slots=True)
class Step:
    """One step of one client."""

    name: str
    passed: bool
    seen: str
    """What was seen, or what went wrong."""
    seconds: float


@dataclass(slots=True)
class Session:
    """The steps of one client with one flavour, in order; a failed one does not end the others."""

    client: str
    flavour: str
    steps: list[Step] = field(default_factory=list)

    async def step(self, name: str, action: Callable[[], Awaitable[str]], limit_s: float) -> None:
        """Take a step; the action tells what it saw, and raises if that is not right."""
        started = time.monotonic()
        try:
            seen = await asyncio.wait_for(action(), limit_s)
            passed = True
        except TimeoutError:
            seen, passed = f"not within {limit_s:g} s", False
        except Exception as error:
            seen, passed = f"{type(error).__name__}: {error}", False
        self.steps.append(Step(name, passed, seen, time.monotonic() - started))

    @property
    def failures(self) -> list[str]:
        """What did not go right, for an assertion's text."""
        return [f"{step.name}: {step.seen}" for step in self.steps if not step.passed]
