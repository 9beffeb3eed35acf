"""The reports' pages in a browser: whole, without errors, readable on a phone, by day and night."""

import contextlib
import io
from dataclasses import replace

import pytest

from companion.commands.faults import FaultsRequest, run_faults
from companion.commands.report import ReportRequest, run_report
from companion.experiments.paper.figures.render import FOLDER, draw_one
from companion.experiments.paper.report import write_report
from companion.experiments.paper.scale import QUICK
from companion.report.compare_figure import draw_comparison
from companion.report.compare_page.page import write_page
from companion.report.recovery_cell import RecoveryCell
from tests.browser.chromium import WITHOUT_GL, driver, launched
from tests.companion.experiments.campaign_report.folders import rows, write_campaign
from tests.companion.experiments.faults import made_up
from tests.companion.experiments.paper.factory import make_claims, make_results
from tests.companion.report.pages.flight_folder import fly_page, outcome
from tests.companion.report.synthetic_comparison import comparison

PHONE, DESK = 400, 1200
EVENT = RecoveryCell("mpc-l1", "drop", "nominal", "payload dropped", 2, 0.04, 0.05, 0.4, 0.6, 0)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with (
        driver() as playwright,
        launched(playwright, tmp_path_factory.mktemp("browser"), *WITHOUT_GL) as browser,
    ):
        yield browser


def _flight(folder):
    return fly_page(folder)[0]


def _lost_flight(folder):
    note = "no usable state for more than 100 ms, for 0.8 s; the autopilot has landed the vehicle"
    said = [(7.0, "error", f"handing over: {note}"), (7.0, "info", f"phase handed over: {note}")]
    made = outcome("aborted", completed=False, note=note)
    return fly_page(folder, made, end_s=7.5, fallback_s=(7.0, 7.5), messages=said)[0]


def _comparison(folder):
    (folder / "compare.json").write_text("{}")
    draw_comparison(comparison(), folder / "compare.png")
    made = replace(comparison(), recoveries=(EVENT,))
    return write_page(made, [folder / "compare.png"], folder)


def _study(folder):
    results = make_results(QUICK)
    (folder / FOLDER).mkdir()
    figures = [draw_one(results, name, folder) for name in ("time_response", "errors_feedback")]
    return write_report(results, make_claims(), figures, folder)


def _campaign(folder):
    write_campaign(folder, rows(20))
    with contextlib.redirect_stdout(io.StringIO()):
        run_report(ReportRequest(folder))
    return folder / "report" / "report.html"


def _faults(folder):
    with contextlib.redirect_stdout(io.StringIO()):
        run_faults(FaultsRequest(only=("delay", "jitter"), jobs=1, out=folder), made_up.verdict)
    return folder / "faults.html"


MAKERS = {
    "flight": _flight,
    "lost flight": _lost_flight,
    "comparison": _comparison,
    "paper": _study,
    "campaign": _campaign,
    "faults": _faults,
}


@pytest.fixture(scope="module", params=MAKERS.values(), ids=MAKERS)
def report(request, tmp_path_factory):
    return request.param(tmp_path_factory.mktemp("report"))


class Opened:
    """A page as a browser shows it, and what it complained of."""

    def __init__(self, browser, path, width, scheme):
        context = browser.new_context(
            viewport={"width": width, "height": 800}, color_scheme=scheme, reduced_motion="reduce"
        )
        self.page = context.new_page()
        self.complaints = []
        self.asked = []
        self.page.on("console", lambda said: self.complaints.append(said.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("requestfailed", lambda request: self.complaints.append(request.url))
        self.page.goto(path.as_uri())

    def __call__(self, script):
        return self.page.evaluate(script)


@pytest.fixture(scope="module", params=[(PHONE, "light"), (PHONE, "dark"), (DESK, "light")])
def opened(request, browser, report):
    one = Opened(browser, report, *request.param)
    yield one
    one.page.context.close()


LIGHTNESS = """(colour) => {
  const [r, g, b] = colour.match(/[\\d.]+/g).map(Number);
  return (0.2126 * r + 0.7152 * g + 0.0722 * b) / 255;
}"""


def test_a_page_is_whole_and_fits_its_window(opened):
    assert opened.complaints == []
    assert all(url.startswith("file:") for url in opened.asked)
    assert opened("document.documentElement.scrollWidth <= window.innerWidth")
    broken = "Array.from(document.images).filter((i) => !i.naturalWidth).map((i) => i.src)"
    assert opened(broken) == []
    flat = (
        "Array.from(document.querySelectorAll('figure svg')).filter((s) => s.checkVisibility() && "
        "(s.clientWidth < 100 || s.clientHeight < 50)).length"
    )
    assert opened(flat) == 0


def test_what_is_wider_than_its_box_scrolls_in_it_and_can_be_reached_by_keyboard(opened):
    loose = (
        "Array.from(document.querySelectorAll('.wide, .drawing'))"
        ".filter((box) => box.scrollWidth > box.clientWidth + 1)"
        ".filter((box) => box.tabIndex < 0 || getComputedStyle(box).overflowX !== 'auto').length"
    )
    assert opened(loose) == 0


def test_the_answer_is_in_sight_and_can_be_read(opened):
    box = opened.page.locator("#glance .sentence").bounding_box()
    assert box["y"] < 800
    ink = opened("getComputedStyle(document.querySelector('#glance .sentence')).color")
    paper = opened("getComputedStyle(document.querySelector('#glance')).backgroundColor")
    is_dark = opened("matchMedia('(prefers-color-scheme: dark)').matches")
    light = {name: opened(f"({LIGHTNESS})('{colour}')") for name, colour in
             (("ink", ink), ("paper", paper))}  # fmt: skip
    assert (light["paper"] < 0.2) is is_dark
    assert abs(light["ink"] - light["paper"]) > 0.6
