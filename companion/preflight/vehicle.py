"""Who answers, and whether it stands as it should before a flight."""

from companion.preflight.facts import Identity
from companion.preflight.finding import Finding, Verdict

_SET_ATTITUDE_TARGET = 1 << 6
"""MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET."""
_NAMES = {"px4": "PX4", "ardupilot": "ArduPilot"}
_LANDED = {0: "it does not say whether it stands", 1: "on the ground", 2: "in the air",
           3: "taking off", 4: "landing"}  # fmt: skip
_IN_AIR = (2, 3, 4)


def in_use(*, armed: bool, landed_state: int) -> str:
    """How the vehicle is, if it does not stand disarmed; empty if it does.

    Args:
        armed: its motors may turn.
        landed_state: MAV_LANDED_STATE.
    """
    if armed:
        return "armed"
    return _LANDED[landed_state] if landed_state in _IN_AIR else ""


def judge_vehicle(identity: Identity) -> list[Finding]:
    """Findings on the autopilot and its state."""
    return [_autopilot(identity), _state(identity)]


def _autopilot(identity: Identity) -> Finding:
    name = _NAMES.get(identity.autopilot, identity.autopilot)
    found = f"{name} {identity.version}".rstrip()
    found += f", system {identity.system_id}, component {identity.component_id}"
    if identity.capabilities is None:
        return Finding(
            "autopilot", found, Verdict.NOTE, "It does not say what it can (AUTOPILOT_VERSION)."
        )
    if not identity.capabilities & _SET_ATTITUDE_TARGET:
        return Finding(
            "autopilot",
            f"{found}; it says that it takes no attitude setpoints",
            Verdict.REFUSAL,
            "Use a build with SET_ATTITUDE_TARGET, for a multicopter.",
        )
    return Finding("autopilot", found)


def _state(identity: Identity) -> Finding:
    found = (
        f"{'armed' if identity.armed else 'disarmed'}, mode {identity.mode}, "
        f"{_LANDED.get(identity.landed_state, _LANDED[0])}"
    )
    if identity.armed:
        return Finding(
            "state",
            found,
            Verdict.REFUSAL,
            "The companion takes over no flight that it did not start: land and disarm.",
        )
    if identity.landed_state in _IN_AIR:
        return Finding(
            "state",
            found,
            Verdict.REFUSAL,
            "Disarmed and not on the ground: its landing detector is wrong. Restart it.",
        )
    return Finding("state", found)
