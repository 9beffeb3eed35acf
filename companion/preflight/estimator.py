"""Whether the autopilot trusts its own estimate, and would arm.

Flags: https://mavlink.io/en/messages/common.html#ESTIMATOR_STATUS_FLAGS, which ArduPilot's
EKF_STATUS_REPORT shares but for what lies beyond 512.  The bit of a constant position (128) is not
looked at: a running PX4 v1.17 sets it with a position that is fine.
"""

from companion.preflight.facts import EstimatorFacts, Identity
from companion.preflight.finding import Finding, Verdict

ATTITUDE, HORIZONTAL_VELOCITY, VERTICAL_VELOCITY = 1, 2, 4
RELATIVE_POSITION, ABSOLUTE_POSITION, HEIGHT = 8, 16, 32
GPS_GLITCH, BAD_ACCELEROMETER = 1024, 2048

_NEEDED = {
    ATTITUDE: "attitude",
    HORIZONTAL_VELOCITY: "horizontal velocity",
    VERTICAL_VELOCITY: "vertical velocity",
    HEIGHT: "height",
}
_REJECTED = 1.0
_STRAINED = 0.5


def judge_estimator(estimator: EstimatorFacts, identity: Identity) -> list[Finding]:
    """Findings on the estimate, home, and readiness.

    What is not there yet is a warning, not a refusal: it comes with time, and a flight waits.
    """
    findings = [_flags(estimator, identity), *_ratios(estimator)]
    if estimator.home is False:
        findings.append(
            Finding(
                "home",
                "not set yet",
                Verdict.NOTE,
                "It is set once the position is known; the autopilot's return needs it.",
            )
        )
    elif estimator.home:
        findings.append(Finding("home", "set"))
    findings += _ready(estimator, identity)
    return findings


def _flags(estimator: EstimatorFacts, identity: Identity) -> Finding:
    flags = estimator.flags
    if flags is None:
        return Finding("estimate", "the autopilot does not say how good it is", Verdict.NOTE)
    missing = [words for bit, words in _NEEDED.items() if not flags & bit]
    if not flags & (RELATIVE_POSITION | ABSOLUTE_POSITION):
        missing.append("horizontal position")
    if missing:
        return Finding(
            "estimate",
            f"lacks {', '.join(missing)}",
            Verdict.WARNING,
            "Wait for GNSS or motion capture; a flight waits for it (timeouts.ready_s).",
        )
    troubles = []
    if identity.autopilot == "px4" and flags & GPS_GLITCH:
        troubles.append("GNSS jumps")
    if identity.autopilot == "px4" and flags & BAD_ACCELEROMETER:
        troubles.append("the accelerometer is doubted")
    if troubles:
        return Finding(
            "estimate",
            " and ".join(troubles),
            Verdict.WARNING,
            "Wait, move to open sky, or damp the vibration.",
        )
    return Finding("estimate", "attitude, velocity, position and height are there")


def _ratios(estimator: EstimatorFacts) -> list[Finding]:
    """Test ratios: above 1 a measurement is rejected."""
    finite = {name: r for name, r in estimator.ratios.items() if r == r}
    if not finite:
        return []
    name = max(finite, key=lambda key: finite[key])
    found = f"innovations up to {finite[name]:.2f} of what is taken ({name})"
    if finite[name] >= _REJECTED:
        return [
            Finding(
                "innovations",
                found,
                Verdict.WARNING,
                f"The estimator rejects its {name} measurement. Calibrate, or find what disturbs "
                "it.",
            )
        ]
    if finite[name] >= _STRAINED:
        return [Finding("innovations", found, Verdict.NOTE, "Calibrate before the next flight.")]
    return [Finding("innovations", found)]


def _ready(estimator: EstimatorFacts, identity: Identity) -> list[Finding]:
    if estimator.ready is None:
        return [
            Finding(
                "ready to arm",
                f"cannot be told in {identity.mode}: this autopilot's check depends on the mode",
                Verdict.NOTE,
                "A flight changes the mode, then waits for it.",
            )
        ]
    if estimator.ready:
        return [Finding("ready to arm", "yes")]
    return [
        Finding(
            "ready to arm",
            f"no: it waits for {', '.join(estimator.missing) or 'its own checks'}",
            Verdict.WARNING,
            "A flight waits for it (timeouts.ready_s).",
        )
    ]
