"""`report.html`: the report on one page that needs nothing but itself."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from companion.experiments.campaign_report.figures import Figures
from companion.experiments.campaign_report.glance import campaign_glance
from companion.experiments.campaign_report.influence import CONTROLLER, Influence
from companion.experiments.campaign_report.report import Report
from companion.experiments.campaign_report.summary import index_text, mm, share_text
from companion.experiments.campaign_report.tables import Group
from companion.recording.whole_file import write_whole
from companion.report.pages.style import name_of
from companion.report.pages.templating import render_page

NAME = "report.html"
_TEMPLATE = "report.html.j2"
_PACKAGE = "companion.experiments.campaign_report"
_MOST_LOST = 200
_MOST_GROUPS = 60


def write_page(report: Report, figures: Figures, tables: Sequence[Path], folder: Path) -> Path:
    """Write the page.

    Args:
        report: what it says.
        figures: drawn.
        tables: files beside it.
        folder: where to.

    Raises:
        OSError: it can't be written.
    """
    filters: dict[str, Callable[..., str]] = {
        "mm": mm,
        "plain_mm": lambda value: mm(value, ""),
        "share": share_text,
        "index": index_text,
        "name": name_of,
        "p": _p,
        "correlation": _correlation,
        "level_value": _level_value,
    }
    path = folder / NAME
    write_whole(path, render_page(_PACKAGE, _TEMPLATE, _context(report, figures, tables), filters))
    return path


def _context(report: Report, figures: Figures, tables: Sequence[Path]) -> dict[str, Any]:
    campaign, said = report.campaign, report.campaign.manifest.said
    flights = campaign.flights
    grouped = _by(report.groups)
    crossed = max((by for by in grouped if len(by) > 1), key=len, default=())
    sensitive = [
        (group, outcome, found)
        for group in report.sensitivity.groups
        for outcome in ("error", "lost")
        if (found := report.sensitivity.of(group, outcome))
    ]
    return {
        "glance": campaign_glance(report),
        "name": campaign.manifest.name,
        "says": said.get("says") or "",
        "engine": campaign.manifest.engine,
        "planned": campaign.manifest.flights,
        "flown": len(flights),
        "tracked": int((~flights.lost).sum()),
        "lost_count": len(report.lost),
        "missing": campaign.missing,
        "summary": report.summary,
        "remarks": report.remarks,
        "controllers": grouped.get((CONTROLLER,)) or grouped[()],
        "marginals": [(by[0], grouped[by]) for by in grouped if len(by) == 1],
        "crossed": crossed,
        "crossed_groups": grouped.get(crossed, [])[:_MOST_GROUPS] if crossed else [],
        "crossed_left_out": max(0, len(grouped.get(crossed, [])) - _MOST_GROUPS) if crossed else 0,
        "worst": report.worst,
        "lost": report.lost[:_MOST_LOST],
        "unflown": report.unflown[:_MOST_LOST],
        "reasons": report.reasons,
        "varying": [p.name for p in campaign.parameters],
        "sensitive": sensitive,
        "sums": {(group, outcome): _sum(found) for group, outcome, found in sensitive},
        "figures": figures,
        "parameters": campaign.manifest.parameters,
        "command": said.get("command", "–"),
        "version": said.get("version", "–"),
        "commit": said.get("commit", ""),
        "date": said.get("date", "–"),
        "machine": _machine(said.get("machine")),
        "sampling": _sampling(said.get("sampling")),
        "file": said.get("file", "–"),
        "tables": [path.name for path in tables],
    }


def _by(groups: Sequence[Group]) -> dict[tuple[str, ...], list[Group]]:
    found: dict[tuple[str, ...], list[Group]] = {}
    for group in groups:
        found.setdefault(group.by, []).append(group)
    return found


def _sum(found: Sequence[Influence]) -> float:
    return sum(one.share.value for one in found if not math.isnan(one.share.value))


def _p(value: float) -> str:
    if math.isnan(value):
        return "–"
    return "< 0.01" if value < 0.01 else f"{value:.2f}"


def _correlation(one: Influence) -> str:
    """Spearman's with its interval, with true minus signs."""
    found = one.correlation
    if math.isnan(found.value):
        return "–"
    text = f"{found.value:+.2f}"
    if not math.isnan(found.low):
        text += f" ({found.low:+.2f} … {found.high:+.2f})"
    return text.replace("-", "−")


def _level_value(value: float, outcome: str) -> str:
    return f"{100.0 * value:.0f} % lost" if outcome == "lost" else mm(value)


def _machine(said: object) -> str:
    if isinstance(said, Mapping):
        plain = {k: v for k, v in said.items() if not isinstance(v, Mapping)}
        libraries = said.get("libraries")
        if isinstance(libraries, Mapping):
            plain |= libraries
        return ", ".join(f"{key} {value}" for key, value in plain.items())
    return str(said or "–")


def _sampling(said: object) -> str:
    if isinstance(said, Mapping):
        return ", ".join(f"{key} {value}" for key, value in said.items() if value is not None)
    return str(said or "–")
