"""The summary box of a campaign's page: the share that tracked, the worst, what hurts most."""

import math

from companion.experiments.campaign_report.report import Report
from companion.experiments.campaign_report.summary import mm, share_text
from companion.report.pages.glance import Glance, KeyFigure, Level
from companion.report.pages.style import name_of, percent


def campaign_glance(report: Report) -> Glance:
    """The box."""
    campaign = report.campaign
    flights = len(campaign.flights)
    lost = len(report.lost)
    if not flights:
        return Glance("bad", "No flight could be flown.")
    whole = next(group for group in report.groups if not group.by)
    kept = whole.lost.rest
    sentence = f"{kept.count} of {flights} flights tracked to the end ({percent(kept.share)})"
    if flights == 1:
        sentence = "The one flight tracked to the end" if kept.count else "The one flight was lost"
    worst_m = whole.mean_error.worst_tracked
    if kept.count and math.isfinite(worst_m) and flights > 1:
        sentence += f"; the worst of these had a mean error of {mm(worst_m)}"
    hurts = _hurts_most(report)
    if hurts:
        sentence += f"; {hurts} hurts most"
    level: Level = "bad" if not kept.count else "half" if lost or campaign.missing else "good"
    median_m = whole.mean_error.median
    figures = (
        KeyFigure("tracked to the end", share_text(kept).partition(" (")[0]),
        KeyFigure("median error", *_split(median_m)),
        KeyFigure("worst that tracked", *_split(worst_m)),
        KeyFigure("lost", f"{lost}", "", "half" if lost else None),
        KeyFigure("flown", f"{flights} of {campaign.manifest.flights}"),
    )
    reasons = tuple(
        f"{reason.count} lost{_by(reason.controller)}: {reason.note or reason.outcome}"
        for reason in report.reasons[:3]
    )
    return Glance(level, f"{sentence}.", figures, reasons)


def _hurts_most(report: Report) -> str:
    """The parameter that decides most of the error, the controller aside, if one is seen."""
    for group in report.sensitivity.groups:
        for one in report.sensitivity.of(group, "error"):
            if one.seen and one.parameter != "controller":
                return one.parameter
    return ""


def _by(controller: str) -> str:
    return f" by {name_of(controller)}" if controller else ""


def _split(value_m: float) -> tuple[str, str]:
    """Value and unit apart; a dash or a word has none."""
    text, _, unit = mm(value_m).partition(" ")
    return text, unit
