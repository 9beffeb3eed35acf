"""The part of a certificate's table that every kind of certificate has: conditions and verdict."""

from collections.abc import Callable, Sequence
from typing import Protocol

from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.theory.conditions import Condition


class CertifiedAxis(Protocol):
    """An axis with its conditions."""

    @property
    def axis(self) -> str:
        """Its name."""

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The same ones on every axis."""

    @property
    def holds(self) -> bool:
        """Every condition holds."""


def print_verdict(console: Console, axes: Sequence[CertifiedAxis]) -> None:
    """Say in words what fails, what to be careful about, and whether all holds."""
    for axis, names in _grouped(axes, lambda c: c.reason):
        console.print(Text(f"fails on {names}: {axis}", style="red"))
    for axis, names in _grouped(axes, lambda c: c.caution):
        console.print(Text(f"caution on {names}: {axis}", style="yellow"))
    verdict, style = "not certified", "bold red"
    if all(axis.holds for axis in axes):
        cautious = any(c.caution for axis in axes for c in axis.conditions)
        verdict = "certified: every condition holds" + (", with caution" if cautious else "")
        style = "bold yellow" if cautious else "bold green"
    console.print(Text(verdict), style=style)


def conditions_table(axes: Sequence[CertifiedAxis]) -> Table:
    """One row for each condition."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("condition", no_wrap=True)
    for axis in axes:
        table.add_column(axis.axis, no_wrap=True)
    table.add_column("found", overflow="fold")
    for k, condition in enumerate(axes[0].conditions):
        table.add_row(condition.name, *(_mark(axis, k) for axis in axes), _found(axes, k))
    return table


def _found(axes: Sequence[CertifiedAxis], k: int) -> str:
    """The figures of a condition; those that axes share once."""
    by_text: dict[str, list[str]] = {}
    for axis in axes:
        by_text.setdefault(axis.conditions[k].found, []).append(axis.axis)
    if len(by_text) == 1:
        return next(iter(by_text))
    return "\n".join(f"{', '.join(names)}: {found}" for found, names in by_text.items())


def _mark(axis: CertifiedAxis, k: int) -> Text:
    condition = axis.conditions[k]
    if not condition.holds:
        return Text("no", style="bold red")
    return Text("yes", style="yellow" if condition.caution else "green")


def _grouped(
    axes: Sequence[CertifiedAxis], text: Callable[[Condition], str]
) -> list[tuple[str, str]]:
    """Texts with the axes and conditions that they belong to, equal ones joined."""
    found: dict[tuple[str, str], list[str]] = {}
    for axis in axes:
        for condition in axis.conditions:
            if text(condition):
                found.setdefault((condition.name, text(condition)), []).append(axis.axis)
    return [(said, f"{', '.join(names)} ({name})") for (name, said), names in found.items()]
