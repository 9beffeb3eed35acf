"""What a check sets with leave: for good, and back."""

from dataclasses import replace
from pathlib import Path

from companion.flight.check.fixing import Tell, note_changes, restore_parameters, set_parameters
from companion.flight.check.restore_file import RestoreFileError, RestoreList
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.parameters import Parameters
from companion.preflight.facts import Facts, Plan
from companion.preflight.finding import Finding, ParameterChange, Verdict
from companion.preflight.judgement import mend
from companion.preflight.vehicle import in_use


async def fix_for_good(
    facts: Facts, plan: Plan, connection: Connection, path: Path, tell: Tell
) -> tuple[Facts, list[Finding]]:
    """Set what should be otherwise, for good.

    Returns:
        The facts with what the autopilot has then, and what came of it.
    """
    reports = connection.reports
    used = in_use(armed=reports.armed, landed_state=reports.landed_state)
    if used:
        found = f"nothing is set: the vehicle is {used}, and a failsafe set now acts in the air"
        return facts, [Finding("--fix", found, Verdict.REFUSAL, "Land and disarm first.")]
    changes, _ = mend(facts, plan, connection.dialect.thrust_meaning)
    if not changes:
        return facts, [Finding("--fix", "nothing had to be set")]
    try:
        note_changes(connection, changes, path)
    except RestoreFileError as error:
        return facts, [Finding("--fix", str(error), Verdict.REFUSAL)]
    problems = await set_parameters(connection, changes, tell)
    facts = await _with_what_is_there_now(facts, changes, connection)
    if problems:
        return facts, [Finding("--fix", problem, Verdict.REFUSAL) for problem in problems]
    names = ", ".join(change.name for change in changes)
    return facts, [Finding("--fix", f"set {names}; {path} lists what they were", Verdict.NOTE)]


async def _with_what_is_there_now(
    facts: Facts, changes: list[ParameterChange], connection: Connection
) -> Facts:
    """The facts with these parameters read again; one that is not answered now is not known."""
    names = [change.name for change in changes]
    reader = Parameters(connection)
    try:
        now = await reader.read(names)
    finally:
        reader.close()
    known = {name: value for name, value in facts.parameters.items() if name not in names}
    parameters = {**known, **now}
    thrust = connection.dialect.thrust_meaning(parameters)
    return replace(facts, parameters=parameters, thrust=thrust)


async def restore_list(
    wanted: RestoreList, connection: Connection, tell: Tell
) -> tuple[tuple[Finding, ...], bool]:
    """Set back what a list says, on the vehicle that it was written for.

    Returns:
        What came of it, and whether all of it is as it was.
    """
    if (wanted.autopilot, wanted.system_id) != (
        connection.dialect.name,
        connection.target.system_id,
    ):
        problem = (
            f"the file is of system {wanted.system_id} ({wanted.autopilot}), this is system "
            f"{connection.target.system_id} ({connection.dialect.name})"
        )
        advice = "Connect to the vehicle that the parameters were set on."
        return (Finding("--restore", problem, Verdict.REFUSAL, advice),), False
    if connection.reports.armed:
        problem = "the vehicle is armed"
        return (Finding("--restore", problem, Verdict.REFUSAL, "Land and disarm first."),), False
    problems = await restore_parameters(connection, wanted.changes, tell)
    names = ", ".join(change.name for change in wanted.changes)
    found = tuple(Finding("--restore", problem, Verdict.REFUSAL) for problem in problems)
    return found or (Finding("--restore", f"done: {names}"),), not problems
