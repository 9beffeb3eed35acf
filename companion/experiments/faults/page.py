"""`faults.html`: the table on one page that needs nothing but itself."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from companion.experiments.faults.drawing import draw
from companion.experiments.faults.glance import table_glance
from companion.experiments.faults.study import Result, Unflown
from companion.experiments.faults.written import NAME as JSON_NAME
from companion.experiments.faults.written import Made, RowResult, counts
from companion.recording.whole_file import write_whole
from companion.report.pages.templating import render_page

NAME = "faults.html"
_TEMPLATE = "faults.html.j2"
_GROUPS = {"link": "The link", "vehicle": "The vehicle", "process": "The companion's process"}
_SIGNS = {"passed": "✓", "failed": "✗", "not flown": "–"}


def write_page(results: Sequence[RowResult], made: Made, folder: Path) -> Path:
    """Write the page.

    Args:
        results: rows and their flights.
        made: where the figures come from.
        folder: where to.

    Raises:
        OSError: it can't be written.
    """
    groups = [
        (key, title, [_row(result) for result in results if result.row.group == key])
        for key, title in _GROUPS.items()
    ]
    context = {
        "glance": table_glance(results),
        "groups": [group for group in groups if group[2]],
        "counts": {key: count for key, count in counts(results).items() if count},
        "signs": _SIGNS,
        "made": made,
        "json_name": JSON_NAME,
    }
    text = render_page("companion.experiments.faults", _TEMPLATE, context, {"codes": codes})
    path = folder / NAME
    write_whole(path, text)
    return path


def _row(result: RowResult) -> dict[str, Any]:
    return {
        "row": result.row,
        "verdict": result.verdict,
        "flights": [_flight(flight) for flight in result.flights],
    }


def _flight(flight: Result) -> dict[str, Any]:
    if isinstance(flight, Unflown):
        return {
            "autopilot": flight.autopilot,
            "passed": False,
            "ending": "not flown",
            "broken": (flight.reason,),
            "figures": (),
            "svg": "",
            "note": "",
            "command": "",
            "after": "–",
        }
    measured = flight.judgement.measured
    svg = draw(flight.curves, f"{flight.row} under {flight.autopilot}: error and tilt by time")
    return {
        "autopilot": flight.autopilot,
        "passed": flight.passed,
        "ending": measured.ending,
        "broken": flight.judgement.broken,
        "figures": _figures(flight),
        "svg": svg,
        "note": flight.note,
        "command": flight.command,
        "after": seconds(measured.detected_after_s),
    }


def codes(text: str) -> tuple[tuple[bool, str], ...]:
    """Pieces of a sentence, and whether each stood between backquotes."""
    return tuple((bool(k % 2), piece) for k, piece in enumerate(text.split("`")) if piece)


def seconds(value: float) -> str:
    """A time for a reader; a dash where there is none."""
    return "–" if math.isnan(value) else f"{value:.2f} s"


def _figures(flight: Result) -> tuple[tuple[str, str], ...]:
    assert not isinstance(flight, Unflown)
    m = flight.judgement.measured
    told = [
        ("seen after", seconds(m.detected_after_s), m.detected_after_s),
        ("handed over after", seconds(m.handed_over_after_s), m.handed_over_after_s),
        ("seen by", m.detected_by, 0.0 if m.detected_by else math.nan),
        ("mean error", f"{m.mean_error_mm:.0f} mm", m.mean_error_mm),
        ("worst error", f"{m.worst_error_mm:.0f} mm", m.worst_error_mm),
        ("largest tilt commanded", f"{m.largest_tilt_deg:.1f}°", m.largest_tilt_deg),
        ("largest true tilt", f"{m.true_tilt_deg:.1f}°", m.true_tilt_deg),
        ("of it while flown", f"{m.flown_tilt_deg:.1f}°", m.flown_tilt_deg),
        ("met the ground with", f"{m.touchdown_m_s:.2f} m/s", m.touchdown_m_s),
        ("sideways then", f"{m.slide_m_s:.2f} m/s", m.slide_m_s),
        ("oldest state behind a tilt", f"{m.oldest_state_s * 1e3:.0f} ms", m.oldest_state_s),
        ("commands to arm", str(m.arm_commands), m.arm_commands),
        ("ended from home", f"{m.from_home_m:.1f} m", m.from_home_m),
    ]
    return tuple((name, text) for name, text, value in told if not math.isnan(value))
