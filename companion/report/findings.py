"""What a check found, as a table in the terminal and as an object for machines."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, is_dataclass
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.preflight.facts import Facts
from companion.preflight.finding import Finding, Verdict, changes_of, with_verdict, worst

_MARKS = {
    Verdict.OK: ("ok", "green"),
    Verdict.NOTE: ("note", "cyan"),
    Verdict.WARNING: ("WARNING", "bold yellow"),
    Verdict.REFUSAL: ("REFUSED", "bold red"),
}
_SUMMARIES = {
    Verdict.OK: "fine: nothing stands against a flight",
    Verdict.NOTE: "fine: nothing stands against a flight",
    Verdict.WARNING: "it would fly, see above",
    Verdict.REFUSAL: "it would not fly like this",
}


def print_findings(console: Console, findings: Sequence[Finding], title: str) -> None:
    """Print what was found, what to do about it, and the parameters that would be set.

    Args:
        console: where to.
        findings: in the order in which they are told.
        title: what was checked.
    """
    console.print(Text(title, style="bold"))
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("what", overflow="fold", max_width=19)
    table.add_column("verdict", no_wrap=True)
    table.add_column("found → what to do", overflow="fold")
    for finding in findings:
        mark, style = _MARKS[finding.verdict]
        text = Text(finding.found)
        if finding.advice:
            text.append(f"\n→ {finding.advice}", style="bold")
        table.add_row(finding.subject, Text(mark, style=style), text)
    console.print(table)
    changes = changes_of(findings)
    if changes:
        console.print()
        console.print(Text("to set, or have set by --fix:"))
        for change in changes:
            console.print(Text(f"  {change}"))
    console.print()
    verdict = worst(findings)
    console.print(Text(summary(findings), style=_MARKS[verdict][1]))


def summary(findings: Sequence[Finding]) -> str:
    """One line: how many of what, and what that means."""
    counts = [
        f"{len(with_verdict(findings, verdict))} {name}"
        for verdict, name in ((Verdict.REFUSAL, "refused"), (Verdict.WARNING, "warnings"))
        if with_verdict(findings, verdict)
    ]
    meaning = _SUMMARIES[worst(findings)]
    return f"{', '.join(counts)}: {meaning}" if counts else meaning


def findings_object(findings: Sequence[Finding], facts: Facts | None, link: str) -> dict[str, Any]:
    """The same for machines; numbers that are not finite are null.

    Args:
        findings: in the order in which they are told.
        facts: what was gathered; None if nothing could be.
        link: over what.
    """
    return {
        "verdict": str(worst(findings)),
        "link": link,
        "findings": [_plain(asdict(finding)) for finding in findings],
        "measured": None if facts is None else _plain(asdict(facts)),
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - whatever dataclasses hold
    """The value as JSON can have it."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, str):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    return value
