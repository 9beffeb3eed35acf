"""MAVSDK and MAVProxy, as their users use them, against both flavours over UDP."""

from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from tests.conformance import mavproxy_client, mavsdk_client
from tests.conformance.page import verdicts
from tests.conformance.steps import FLAVOURS, Session

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(420)]

_PAGE = Path(__file__).parents[2] / "docs" / "conformance.md"


@pytest.mark.parametrize("flavour", FLAVOURS)
@pytest.mark.parametrize(
    "run", [mavsdk_client.run, mavproxy_client.run], ids=["mavsdk", "mavproxy"]
)
async def test_every_step_goes_well_and_is_on_the_page(
    run: Callable[[str], Awaitable[Session]], flavour: str
) -> None:
    session = await run(flavour)
    assert not session.failures
    stated = verdicts(_PAGE.read_text())
    mine = {
        name: ok
        for (client, name, f), ok in stated.items()
        if (client, f) == (session.client, flavour)
    }
    assert mine == {step.name: step.passed for step in session.steps}
