"""The live page in a browser: a flight is seen, looked through afterwards, and landed."""

import re

import pytest

from tests.browser import fake_flight, live_bench
from tests.browser.chromium import SOFTWARE_GL, WITHOUT_GL, Trouble, driver, launched, until

DESK = {"width": 1280, "height": 800}
PHONE = {"width": 400, "height": 850}


@pytest.fixture(scope="module")
def playwright():
    with driver() as playwright:
        yield playwright


@pytest.fixture(scope="module")
def browser(playwright, tmp_path_factory):
    with launched(playwright, tmp_path_factory.mktemp("browser"), *WITHOUT_GL) as browser:
        yield browser


@pytest.fixture
def page(browser):
    context = browser.new_context(viewport=DESK)
    yield context.new_page()
    context.close()


@pytest.fixture(scope="module")
def recorded():
    server = live_bench.recorded()
    yield server
    server.stop()


@pytest.fixture
def live():
    server = live_bench.live()
    yield server
    server.stop()


def shown_time_s(page) -> float:
    """Of the slider's clock."""
    return float(re.match(r"([\d.]+) s", page.text_content("#clock"))[1])


def painted(page, selector: str) -> int:
    """How many pixels of the canvases are not empty."""
    return page.evaluate(
        """(selector) => [...document.querySelectorAll(selector)].reduce((sum, canvas) => {
            const context = canvas.getContext("2d");
            if (!context || !canvas.width || !canvas.height) return sum;
            const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
            let count = 0;
            for (let i = 3; i < data.length; i += 4) count += data[i] > 0;
            return sum + count;
        }, 0)""",
        selector,
    )


def test_a_recorded_flight_is_shown_whole_and_quietly(page, recorded) -> None:
    trouble = Trouble(page)
    page.goto(recorded.url)
    page.wait_for_selector("#player:not([hidden])")
    assert page.text_content("#title") == "traj-4 with the fan"
    assert page.locator("#charts canvas").count() == 6
    assert painted(page, "#charts canvas") > 20_000
    assert "23.4 mm" in page.text_content("#outcome")
    assert trouble.said == []
    assert trouble.foreign(recorded.url) == []


def test_the_slider_goes_through_the_flight_by_keyboard(page, recorded) -> None:
    page.goto(recorded.url)
    page.wait_for_selector("#player:not([hidden])")
    slider = page.locator("#slider")
    slider.focus()
    slider.press("End")
    end_s = shown_time_s(page)
    assert end_s == pytest.approx(fake_flight.END_S, abs=0.2)
    slider.press("ArrowLeft")
    assert shown_time_s(page) < end_s
    slider.press("Home")
    assert shown_time_s(page) < 0.5
    assert page.text_content("#phase") == "connect"
    assert page.locator("#messages li").count() == 0
    slider.press("End")
    assert page.locator("#messages li").count() == len(fake_flight.MESSAGES)
    assert "of" in slider.get_attribute("aria-valuetext")


def test_it_plays_and_pauses(page, recorded) -> None:
    page.goto(recorded.url)
    page.wait_for_selector("#player:not([hidden])")
    page.locator("#slider").press("Home")
    page.select_option("#speed", "8")
    page.click("#play")
    until(page, "parseFloat(document.getElementById('clock').textContent) > 5")
    page.click("#play")
    stood_s = shown_time_s(page)
    until(page, "document.getElementById('play').getAttribute('aria-label') === 'Play'")
    assert shown_time_s(page) == stood_s


def test_a_recorded_flight_offers_no_commands(page, recorded) -> None:
    page.goto(f"{recorded.url}#token={live_bench.TOKEN}")
    page.wait_for_selector("#player:not([hidden])")
    assert not page.locator("#pilot").is_visible()


def test_a_live_flight_moves_as_frames_come(page, live) -> None:
    trouble = Trouble(page)
    page.goto(f"{live.url}#token={live_bench.TOKEN}")
    assert live.joined.acquire(timeout=20)
    until(page, "document.getElementById('figures').textContent.includes('10.0 s')")
    live.send_frames(fake_flight.frames(12.0)[200:])
    until(page, "document.getElementById('figures').textContent.includes('12.0 s')")
    live.send("message", t=12.0, severity="warning", text="something to read")
    until(page, "document.getElementById('messages').textContent.includes('something to read')")
    assert page.text_content("#phase") == "track"
    assert painted(page, "#charts canvas") > 10_000
    assert trouble.said == []


def test_the_token_leaves_the_address(page, live) -> None:
    page.goto(f"{live.url}#token={live_bench.TOKEN}")
    page.wait_for_selector("#land", state="visible")
    assert live_bench.TOKEN not in page.url
    page.reload()
    page.wait_for_selector("#land", state="visible")


def test_without_the_token_one_can_only_look(page, live) -> None:
    page.goto(live.url)
    assert live.joined.acquire(timeout=20)
    until(page, "document.getElementById('phase').textContent === 'track'")
    assert not page.locator("#land").is_visible()


@pytest.mark.parametrize(("name", "says"), [("land", "lands where it is"), ("abort", "failsafe")])
def test_a_command_is_asked_about_before_it_is_sent(page, live, name, says) -> None:
    page.goto(f"{live.url}#token={live_bench.TOKEN}")
    page.click(f"#{name}")
    assert says in page.text_content("#confirm-text")
    assert page.evaluate("document.activeElement.id") == "confirm-no"
    page.keyboard.press("Escape")
    assert not page.locator("#confirm").is_visible()
    page.click(f"#{name}")
    page.keyboard.press("Enter")  # on Cancel
    assert not page.locator("#confirm").is_visible()
    assert live.commands.empty()
    page.click(f"#{name}")
    page.click("#confirm-yes")
    sent = live.commands.get(timeout=20)
    assert sent == {"token": live_bench.TOKEN, "command": name}
    until(page, "document.getElementById('answer').textContent.includes('taken')")


def test_a_command_that_is_refused_is_told(page, live) -> None:
    live.answer = (409, {"error": "this flight is over"})
    page.goto(f"{live.url}#token={live_bench.TOKEN}")
    page.click("#land")
    page.click("#confirm-yes")
    until(page, "document.getElementById('answer').textContent.includes('this flight is over')")


def test_the_end_is_shown_and_the_flight_can_be_looked_through(page, live) -> None:
    page.goto(f"{live.url}#token={live_bench.TOKEN}")
    assert live.joined.acquire(timeout=20)
    page.wait_for_selector("#land", state="visible")
    live.send("end", outcome="aborted", note="the link was lost", mean_error_mm=None)
    page.wait_for_selector("#player:not([hidden])")
    assert "aborted" in page.text_content("#outcome")
    assert not page.locator("#land").is_visible()


def test_a_page_that_has_lost_its_server_says_so_and_comes_back(page) -> None:
    server = live_bench.live()
    page.goto(server.url)
    assert server.joined.acquire(timeout=20)
    server.stop()
    until(page, "document.getElementById('link').dataset.level !== 'good'")
    again = live_bench.live(until_s=11.0, port=server.port)
    try:
        assert again.joined.acquire(timeout=30)
        until(page, "document.getElementById('figures').textContent.includes('11.0 s')")
    finally:
        again.stop()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_fits_a_phone_by_day_and_night(browser, recorded, scheme) -> None:
    context = browser.new_context(viewport=PHONE, color_scheme=scheme)
    page = context.new_page()
    page.goto(recorded.url)
    page.wait_for_selector("#player:not([hidden])")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    shade = page.evaluate(
        "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3)"
        ".reduce((sum, c) => sum + Number(c), 0)"
    )
    assert (shade < 150) == (scheme == "dark")
    for selector in ("#play", "#slider", "#view-reset"):
        box = page.locator(selector).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= PHONE["width"]
        assert box["height"] >= 24
    context.close()


def test_without_webgl_the_path_is_drawn_from_above(page, recorded) -> None:
    page.goto(recorded.url)
    page.wait_for_selector("#player:not([hidden])")
    assert painted(page, "#stage canvas") > 1000


def test_with_webgl_the_scene_is_drawn_in_depth(playwright, recorded, tmp_path) -> None:
    with launched(playwright, tmp_path, *SOFTWARE_GL) as browser:
        page = browser.new_page(viewport=DESK)
        trouble = Trouble(page)
        page.goto(recorded.url)
        page.wait_for_selector("#player:not([hidden])")
        stage = page.locator("#stage")
        assert page.evaluate("!!document.querySelector('#stage canvas').getContext('webgl2')")
        page.locator("#slider").press("Home")
        at_first = stage.screenshot()
        page.locator("#slider").press("End")
        assert stage.screenshot() != at_first
        assert trouble.said == []
