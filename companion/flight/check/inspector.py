"""The checks before one flight, and what they have set, until after it."""

import asyncio
import contextlib
from collections.abc import Mapping
from pathlib import Path

from companion.config.resolve import FlightConfig
from companion.flight.check.fixing import Tell, note_changes, restore_parameters, set_parameters
from companion.flight.check.inspection import gather
from companion.flight.check.plan_to_check import plan_to_check
from companion.flight.check.restore_file import RESTORE_NAME, RestoreFileError
from companion.flight.errors import FlightAbortedError, FlightRefusedError
from companion.flight.vehicle.connection import Connection
from companion.flight.vehicle.parameters import Parameters
from companion.flight.voice import Voice
from companion.preflight.failsafe_ardupilot import HEARTBEAT, acts_without, watched_systems
from companion.preflight.finding import ParameterChange, Verdict, accepting, with_verdict
from companion.preflight.judgement import judge, mend
from companion.trajectories.trajectory import Trajectory

_LISTENED_S = 0.5
"""Until a SYS_STATUS has come; the flight itself measures the streams, at the same time."""
_HEARD_S = 3.0
"""A system that was heard within this time is there."""


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
        self.let_go = False
        """The vehicle may be left armed: it does not miss us, or a person has said so."""
        self._connection = connection
        self._voice = voice
        self._restore_file = folder / RESTORE_NAME
        self._changes: list[ParameterChange] = []
        """What was set, or begun to be."""
        self._found: Mapping[str, float] = {}
        """The parameters as they were found by the last check."""

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
        self._found = facts.parameters
        plan = plan_to_check(self._config, self._trajectory, connection.our_system_id)
        if mission.preflight.fix:
            meaning = connection.dialect.thrust_meaning
            changes, findings = mend(facts, plan, meaning, settled=False)
        else:
            changes = []
            findings = judge(facts, plan, settled=False)
        findings = accepting(findings, mission.preflight.accept)
        for finding in with_verdict(findings, Verdict.WARNING):
            self._voice.tell("warning", finding.sentence)
        refusals = with_verdict(findings, Verdict.REFUSAL)
        if refusals:
            raise FlightRefusedError(" ".join(finding.sentence for finding in refusals))
        await self._fix(changes)

    async def release_heartbeat(self, tell: Tell) -> list[str]:
        """Set back what makes the autopilot act once our heartbeat ends.

        Args:
            tell: told what is set back.

        Returns:
            Why it would act all the same, in sentences; empty if the heartbeat may end.

        Raises:
            FlightAbortedError: the link was lost, or the wait was ended from outside.
        """
        connection = self._connection
        before = {**self._found, **{change.name: change.old for change in self._changes}}
        ours = [change for change in self._changes if change.name in HEARTBEAT]
        if not ours and not acts_without(before, connection.our_system_id):
            return []
        failsafe = [change for change in ours if change.name == HEARTBEAT[0]]
        watched = [change for change in ours if change not in failsafe]
        at_worst = {**before, **{change.name: change.new for change in ours}}
        names = [name for name in HEARTBEAT if name in before]

        problems = await self._set_back(failsafe, tell)
        now = {**at_worst, **await self._read(names)}
        others = watched_systems(before)
        # It counts from the last heartbeat, whosesoever: pointed at a silent system it would act.
        if now[HEARTBEAT[0]] == 0.0 or self._hears(others):
            problems += await self._set_back(watched, tell)
            now = {**at_worst, **await self._read(names)}
        elif watched and not failsafe:
            problems.append(f"System {others.start}, which was watched before, is not heard.")
        acts = acts_without(now, connection.our_system_id)
        if acts:
            return [*problems, acts]
        self._forget([change for change in ours if now[change.name] != change.new])
        return []

    async def _set_back(self, changes: list[ParameterChange], tell: Tell) -> list[str]:
        return await restore_parameters(self._connection, changes, tell) if changes else []

    def _hears(self, systems: range) -> bool:
        now = asyncio.get_running_loop().time()
        peers = self._connection.peers.peers.values()
        return any(p.system_id in systems and now - p.last_heard_s < _HEARD_S for p in peers)

    async def _read(self, names: list[str]) -> dict[str, float]:
        reader = Parameters(self._connection)
        try:
            return await reader.read(names)
        finally:
            reader.close()

    def _forget(self, restored: list[ParameterChange]) -> None:
        """These are as they were; the list on the disk goes with the last of them."""
        self._changes = [change for change in self._changes if change not in restored]
        if restored and not self._changes:
            with contextlib.suppress(OSError):
                self._restore_file.unlink()

    async def after_flight(self) -> None:
        """Set back what was set, once the vehicle stands; never raises for the vehicle's sake."""
        if not self._changes:
            return
        connection, changes = self._connection, self._changes
        by_hand = (
            f"`companion check --connect URL --restore {self._restore_file}` restores "
            f"{', '.join(change.name for change in changes)}"
        )
        if connection.reports.armed:
            self._voice.tell("warning", f"not restored while the vehicle is armed. {by_hand}")
            return
        try:
            with connection.waiting.despite_failure():
                problems = await restore_parameters(connection, changes, self._voice.tell)
        except (FlightAbortedError, FlightRefusedError) as error:
            problems = [str(error)]
        if problems:
            self._voice.tell("error", f"{' '.join(problems)} {by_hand}")
            return
        self._forget(changes)

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
