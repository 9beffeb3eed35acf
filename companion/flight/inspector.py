"""The checks before one flight, and what they have set, until after it."""

import contextlib
from pathlib import Path

from companion.config.resolve import FlightConfig
from companion.flight.connection import Connection
from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.fixing import note_changes, restore_parameters, set_parameters
from companion.flight.inspection import gather
from companion.flight.plan_to_check import plan_to_check
from companion.flight.restore_file import RESTORE_NAME, RestoreFileError
from companion.flight.voice import Voice
from companion.preflight.finding import ParameterChange, Verdict, accepting, with_verdict
from companion.preflight.judgement import judge, mend
from companion.trajectories.trajectory import Trajectory

_LISTENED_S = 0.5
"""Until a SYS_STATUS has come; the flight itself measures the streams."""


class Inspector:
    """Checks a vehicle before its flight; with ``preflight.fix`` sets what it would have otherwise.

    Only warnings and worse are told: who wants all of it asks `companion check`.
    """

    def __init__(
        self,
        config: FlightConfig,
        trajectory: Trajectory,
        connection: Connection,
        voice: Voice,
        folder: Path,
    ) -> None:
        """Prepare the checks of a flight.

        Args:
            config: mission and vehicle.
            trajectory: what is to be tracked.
            connection: to the vehicle, which need not be known yet.
            voice: tells a person.
            folder: of the flight's files, where the restore file goes.
        """
        self._config = config
        self._trajectory = trajectory
        self._connection = connection
        self._voice = voice
        self._restore_file = folder / RESTORE_NAME
        self._changes: list[ParameterChange] = []
        """What was set, or begun to be."""

    async def before_flight(self) -> None:
        """Check; streams have been asked for, the clock is valid, and nothing is armed.

        The flight looks itself at what comes with time: streams, estimate, readiness.

        Raises:
            FlightRefusedError: something forbids the flight; the text says what and the remedy.
            FlightAbortedError: the link was lost, or the wait was ended from outside.
        """
        connection, mission = self._connection, self._config.mission
        facts = await gather(
            connection,
            _LISTENED_S,
            all_of_it=False,
            with_mocap=mission.mocap is not None,
        )
        plan = plan_to_check(self._config, self._trajectory, connection.our_system_id)
        if mission.preflight.fix:
            meaning = connection.dialect.thrust_meaning
            changes, findings = mend(facts, plan, meaning, settled=False)
            await self._fix(changes)
        else:
            findings = judge(facts, plan, settled=False)
        findings = accepting(findings, mission.preflight.accept)
        for finding in with_verdict(findings, Verdict.WARNING):
            self._voice.tell("warning", finding.sentence)
        refusals = with_verdict(findings, Verdict.REFUSAL)
        if refusals:
            raise FlightRefusedError(" ".join(finding.sentence for finding in refusals))

    async def after_flight(self) -> None:
        """Set back what was set, once the vehicle stands; never raises for the vehicle's sake."""
        if not self._changes:
            return
        connection, changes = self._connection, self._changes
        self._changes = []
        by_hand = (
            f"`companion check --connect URL --restore {self._restore_file}` restores "
            f"{', '.join(change.name for change in changes)}"
        )
        if connection.reports.armed:
            self._voice.tell("warning", f"not restored while the vehicle is armed. {by_hand}")
            return
        try:
            problems = await restore_parameters(connection, changes, self._voice.tell)
        except (FlightAbortedError, FlightRefusedError) as error:
            problems = [str(error)]
        if problems:
            self._voice.tell("error", f"{' '.join(problems)} {by_hand}")
            return
        with contextlib.suppress(OSError):
            self._restore_file.unlink()

    async def _fix(self, changes: list[ParameterChange]) -> None:
        """Set what should be otherwise.

        Raises:
            FlightRefusedError: a parameter could not be set, or the restore file not be written.
        """
        if not changes:
            return
        # After a restart of the autopilot this comes again; what was there at first counts.
        before = {change.name: change for change in self._changes}
        noted = [*before.values(), *(change for change in changes if change.name not in before)]
        try:
            note_changes(self._connection, noted, self._restore_file, replace=bool(before))
        except RestoreFileError as error:
            raise FlightRefusedError(str(error)) from error
        self._changes = noted
        problems = await set_parameters(self._connection, changes, self._voice.tell)
        if problems:
            raise FlightRefusedError(" ".join(problems))
