"""Setting the autopilot's parameters for a flight, and setting them back."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from companion.flight.check.restore_file import RestoreList, write_restore_file
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.parameters import Parameters
from companion.mavlink.exchange import Verdict
from companion.preflight.finding import ParameterChange

Tell = Callable[[str, str], None]
"""Told severity and text."""


def note_changes(
    connection: Connection,
    changes: Sequence[ParameterChange],
    path: Path,
    *,
    replace: bool = False,
) -> None:
    """Write the restore file; belongs before `set_parameters`.

    Raises:
        RestoreFileError: it cannot be written, so nothing must be set.
    """
    wanted = RestoreList(connection.dialect.name, connection.target.system_id, tuple(changes))
    write_restore_file(path, wanted, replace=replace)


async def set_parameters(
    connection: Connection, changes: Sequence[ParameterChange], tell: Tell
) -> list[str]:
    """Set each parameter and say so; none on a vehicle that is armed meanwhile.

    Returns:
        What was not set, in sentences; empty if all was.

    Raises:
        FlightAbortedError: the link was lost, or the wait was ended from outside.
    """
    parameters = Parameters(connection)
    problems = []
    try:
        for change in changes:
            if connection.reports.armed:
                problems.append(f"{change.name} was not set: the vehicle is armed.")
                continue
            exchange = await parameters.set(change.name, change.new)
            if exchange.verdict is Verdict.ACCEPTED:
                text = f"set {change.name} from {change.old:g} to {change.new:g}: {change.why}"
                tell("warning", text)
            else:
                problems.append(f"{change.name} could not be set: {exchange.explanation}.")
    finally:
        parameters.close()
    return problems


async def restore_parameters(
    connection: Connection, changes: Sequence[ParameterChange], tell: Tell
) -> list[str]:
    """Set parameters back, the last one first; leave those that somebody else has changed since.

    Returns:
        What could not be restored, in sentences; empty if all is as it was.

    Raises:
        FlightAbortedError: the link was lost, or the wait was ended from outside.
    """
    parameters = Parameters(connection)
    problems = []
    try:
        now = await parameters.read(change.name for change in changes)
        for change in reversed(changes):
            value = now.get(change.name)
            if value is None:
                problems.append(f"{change.name} could not be read; it was {change.old:g} before.")
            elif _same(value, change.old):
                continue
            elif not _same(value, change.new):
                tell(
                    "warning",
                    f"{change.name} is {value:g}, neither {change.old:g} nor {change.new:g}: "
                    "somebody else has set it, and it is left so",
                )
            else:
                exchange = await parameters.set(change.name, change.old)
                if exchange.verdict is Verdict.ACCEPTED:
                    tell("warning", f"restored {change.name} from {change.new:g} to {change.old:g}")
                else:
                    problems.append(
                        f"{change.name} could not be set back to {change.old:g}: "
                        f"{exchange.explanation}."
                    )
    finally:
        parameters.close()
    return problems


def _same(one: float, other: float) -> bool:
    """Equal as far as a 32-bit float can tell."""
    return math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-9)
