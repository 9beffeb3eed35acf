"""What ArduCopter does when the companion dies in flight: by default, nothing that ends well.

Parameters: https://ardupilot.org/copter/docs/parameters.html; how a stream that stops was answered
was seen on a running 4.7.
"""

from collections.abc import Mapping

from companion.preflight.finding import Finding, ParameterChange, Verdict
from companion.preflight.names import Named, first_of

GCS_SYSTEM_ID = ("MAV_GCS_SYSID", "SYSID_MYGCS")
"""Of 4.7, and of the releases before."""
PARAMETERS = ("GUID_TIMEOUT", "FS_GCS_ENABLE", "FS_GCS_TIMEOUT", *GCS_SYSTEM_ID, "MAV_GCS_SYSID_HI")

HEARTBEAT = ("FS_GCS_ENABLE", *GCS_SYSTEM_ID)
"""What makes ArduPilot act once somebody's heartbeat ends, in whatever mode it then is."""

TIMEOUT_S = 0.5
"""What is advised for GUID_TIMEOUT, and the longest that is let pass."""
_SHORT_S = 0.2
_DEFAULT_GCS_TIMEOUT_S = 5.0
_LAND = 5.0

_ACTIONS = {
    1: "returns home at RTL's height",
    2: "returns home at RTL's height, or goes on with a mission",
    3: "goes back as it came, or returns home at RTL's height",
    4: "goes back as it came, or lands",
    5: "lands",
    6: "lands at the mission's landing place, or returns home",
    7: "brakes, or lands",
}
"""FS_GCS_ENABLE."""
_RETURNING = (1, 2, 3, 6)
_OUR_HEARTBEAT = "the companion's heartbeat"


def judge_ardupilot_failsafe(parameters: Mapping[str, float], our_system_id: int) -> list[Finding]:
    """Findings on the loss of the companion.

    Args:
        parameters: as read.
        our_system_id: whose heartbeats we send.
    """
    return [_timeout(parameters.get("GUID_TIMEOUT")), *_heartbeats(parameters, our_system_id)]


def acts_without(parameters: Mapping[str, float], our_system_id: int) -> str:
    """What happens in the air once our heartbeat ends, in a sentence; empty if nothing does.

    Args:
        parameters: as read.
        our_system_id: whose heartbeats we send.
    """
    enabled = parameters.get("FS_GCS_ENABLE", 0.0)
    watched = first_of(parameters, GCS_SYSTEM_ID)
    if enabled == 0.0 or (watched and our_system_id not in watched_systems(parameters)):
        return ""
    return f"FS_GCS_ENABLE is {_consequence(enabled, parameters, _OUR_HEARTBEAT)}."


def watched_systems(parameters: Mapping[str, float]) -> range:
    """Systems whose heartbeats are watched; none if that is not known."""
    watched = first_of(parameters, GCS_SYSTEM_ID)
    if watched is None:
        return range(0)
    highest = max(watched.value, parameters.get("MAV_GCS_SYSID_HI", 0.0))
    return range(int(watched.value), int(highest) + 1)


def _timeout(timeout_s: float | None) -> Finding:
    subject = "GUID_TIMEOUT"
    if timeout_s is None:
        return _unread(subject, "how long a dead companion's last setpoint is flown is not known")
    if timeout_s > TIMEOUT_S + 1e-6:
        return Finding(
            subject,
            f"{timeout_s:g} s: a dead companion's last setpoint is flown for as long, then the "
            "vehicle levels and drifts, in GUIDED, holding no position",
            Verdict.WARNING,
            f"Set {TIMEOUT_S:g} s or less.",
            ParameterChange(
                subject,
                timeout_s,
                TIMEOUT_S,
                f"a dead companion's last setpoint is flown for {TIMEOUT_S:g} s, not "
                f"{timeout_s:g} s",
            ),
        )
    found = f"{timeout_s:g} s without a setpoint and the vehicle levels, then drifts"
    if timeout_s < _SHORT_S:
        return Finding(
            subject, found, Verdict.NOTE, "A short pause of this computer shows in the flight."
        )
    return Finding(subject, found)


def _heartbeats(parameters: Mapping[str, float], our_system_id: int) -> list[Finding]:
    """The failsafe that watches for heartbeats, the only one that catches a dead companion."""
    enabled = parameters.get("FS_GCS_ENABLE")
    if enabled is None:
        return [_unread("FS_GCS_ENABLE", "whether a dead companion is caught is not known")]
    watched = first_of(parameters, GCS_SYSTEM_ID)
    findings = []
    watches_us = our_system_id in watched_systems(parameters)
    if watched is not None and not watches_us:
        findings.append(_other_system(watched, our_system_id, matters=enabled != 0.0))
    if enabled == 0.0:
        advice = f"Set FS_GCS_ENABLE {_LAND:g}: land"
        if watched is not None and not watches_us:
            advice += f", and {watched.name} {our_system_id}, ours"
        findings.append(
            Finding(
                "FS_GCS_ENABLE",
                "0: nothing catches a dead companion",
                Verdict.WARNING,
                f"{advice}.",
                ParameterChange(
                    "FS_GCS_ENABLE", enabled, _LAND, "without the companion's heartbeat it lands"
                ),
            )
        )
    else:
        findings.append(_action(enabled, parameters, caught=watches_us or watched is None))
    return findings


def _other_system(watched: Named, our_system_id: int, *, matters: bool) -> Finding:
    return Finding(
        watched.name,
        f"{watched.value:g}: heartbeats of system {watched.value:g} are watched, ours come from "
        f"{our_system_id}",
        Verdict.WARNING if matters else Verdict.NOTE,
        f"Set {our_system_id} for the flight. A ground station of another number is then not "
        "watched, and its joystick not obeyed.",
        ParameterChange(
            watched.name,
            watched.value,
            float(our_system_id),
            "the companion's heartbeat is the one that is watched",
        ),
    )


def _action(enabled: float, parameters: Mapping[str, float], *, caught: bool) -> Finding:
    whose = _OUR_HEARTBEAT if caught else "the watched heartbeat"
    found = _consequence(enabled, parameters, whose)
    if int(enabled) in _RETURNING:
        return Finding(
            "FS_GCS_ENABLE", found, Verdict.NOTE, f"Indoors rather let it land ({_LAND:g})."
        )
    return Finding("FS_GCS_ENABLE", found)


def _consequence(enabled: float, parameters: Mapping[str, float], whose: str) -> str:
    action = _ACTIONS.get(int(enabled), "does what is not known here")
    timeout_s = parameters.get("FS_GCS_TIMEOUT", _DEFAULT_GCS_TIMEOUT_S)
    return f"{enabled:g}: {timeout_s:g} s without {whose} and the vehicle {action}"


def _unread(subject: str, consequence: str) -> Finding:
    return Finding(
        subject,
        f"could not be read: {consequence}",
        Verdict.WARNING,
        "Look it up in a ground station.",
    )
