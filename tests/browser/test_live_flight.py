"""A real-time flight is seen in a browser, and landed from there."""

import contextlib

import pytest

from tests.browser.chromium import WITHOUT_GL, Trouble, driver, launched, until
from tests.flights.process_flight import Flight

pytestmark = pytest.mark.realtime


def test_the_vehicle_is_seen_to_move_the_charts_to_fill_and_land_lands_it(tmp_path) -> None:
    # Drawn from above: a 3-D scene in software would take the processor from the flight.
    with (
        driver() as playwright,
        launched(playwright, tmp_path, *WITHOUT_GL) as browser,
        contextlib.ExitStack() as stack,
    ):
        page = browser.new_page(viewport={"width": 700, "height": 700})
        trouble = Trouble(page)
        flight = Flight(tmp_path, "--live")
        stack.callback(flight.process.kill)
        url = next(
            line.split()[-1] for line in flight.process.stderr if line.startswith("live page: ")
        )
        page.goto(url)
        until(page, "document.getElementById('phase').textContent === 'track'", 60.0)
        before = page.text_content("#figures")
        page.wait_for_function(
            "before => document.getElementById('figures').textContent !== before", arg=before
        )
        charts = page.locator("#charts canvas")
        assert charts.count() == 6
        assert page.locator("#chips").text_content()
        page.click("#land")
        page.click("#confirm-yes")
        until(page, "document.getElementById('answer').textContent.includes('taken')")
        until(page, "document.getElementById('outcome').textContent.includes('landed')", 60.0)
        result, said = flight.end()
        assert result["outcome"] == "landed", said
        assert not result["completed"]
        assert trouble.said == []
        assert page.locator("#player").is_visible()
