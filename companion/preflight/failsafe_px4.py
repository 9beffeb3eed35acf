"""What PX4 does when the companion dies in flight.

Parameters: https://docs.px4.io/main/en/advanced_config/parameter_reference.html#commander;
how a stream that stops was answered was seen on a running v1.17.
"""

from collections.abc import Mapping

from companion.preflight.finding import Finding, ParameterChange, Verdict

PARAMETERS = ("COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_RC_OVERRIDE", "NAV_DLL_ACT")

LOSS_TIME_S = 1.0
"""PX4's default: short enough, and longer than a pause of this computer."""
_LONGEST_S = 1.5
_SHORTEST_S = 0.1
_SHORT_S = 0.3

_ACTIONS: dict[int, tuple[str, Verdict]] = {
    0: ("position mode; without sticks it sinks, lands and disarms", Verdict.OK),
    1: ("altitude mode, which drifts with the wind unless a pilot flies it", Verdict.WARNING),
    2: ("manual mode, which falls out of the air unless a pilot flies it", Verdict.WARNING),
    3: ("return, at its own height and speed", Verdict.NOTE),
    4: ("land", Verdict.OK),
    5: ("hold, for as long as the battery lasts", Verdict.OK),
    6: ("terminate: the motors stop in the air", Verdict.REFUSAL),
    7: ("disarm: the motors stop in the air", Verdict.REFUSAL),
}
"""COM_OBL_RC_ACT: what it means, and how it weighs.

A hand-over to PX4 is nothing but the end of the setpoints, so this is not for accidents alone.
"""
_LAND = 4.0
_ADVICE = {
    Verdict.NOTE: "Indoors rather let it land (COM_OBL_RC_ACT 4).",
    Verdict.WARNING: "Let it land (COM_OBL_RC_ACT 4) or hold (5), unless a pilot has the sticks.",
    Verdict.REFUSAL: "Every hand-over of the companion would end so. Let it land (4) or hold (5).",
}


def judge_px4_failsafe(parameters: Mapping[str, float], clock_rate: float) -> list[Finding]:
    """Findings on the loss of the companion.

    Args:
        parameters: as read.
        clock_rate: the autopilot's clock by ours; PX4 in a simulation that runs faster than ours
            stretches COM_OF_LOSS_T by as much.
    """
    return [
        _loss_time(parameters.get("COM_OF_LOSS_T"), clock_rate),
        _action(parameters.get("COM_OBL_RC_ACT")),
        *_sticks(parameters.get("COM_RC_OVERRIDE")),
        *_data_link(parameters.get("NAV_DLL_ACT")),
    ]


def _loss_time(loss_s: float | None, clock_rate: float) -> Finding:
    subject = "COM_OF_LOSS_T"
    if loss_s is None:
        return _unread(subject, "when PX4 takes the companion for lost is not known")
    found = f"{loss_s:g} s without a setpoint and PX4's failsafe acts"
    change = ParameterChange(subject, loss_s, LOSS_TIME_S, "the failsafe acts after 1 s")
    if loss_s < _SHORTEST_S:
        return Finding(
            subject,
            found,
            Verdict.REFUSAL,
            "That is shorter than the least pause of a link: OFFBOARD would not last. Set 1.",
            change,
        )
    if loss_s < _SHORT_S:
        return Finding(
            subject, found, Verdict.NOTE, "A short pause of this computer ends the flight. Set 1."
        )
    if loss_s > _LONGEST_S * max(1.0, clock_rate):
        return Finding(
            subject,
            found,
            Verdict.WARNING,
            f"A dead companion flies on with its last setpoint for {loss_s:g} s. Set 1.",
            change,
        )
    return Finding(subject, found)


def _action(value: float | None) -> Finding:
    subject = "COM_OBL_RC_ACT"
    if value is None:
        return _unread(subject, "what PX4 does without the companion is not known")
    meaning, verdict = _ACTIONS.get(int(value), ("not known here", Verdict.WARNING))
    change = None
    if verdict.weight >= Verdict.WARNING.weight:
        change = ParameterChange(subject, value, _LAND, "without the companion it lands")
    return Finding(
        subject, f"{value:g}, then: {meaning}", verdict, _ADVICE.get(verdict, ""), change
    )


def _sticks(override: float | None) -> list[Finding]:
    if override is None:
        return []
    if int(override) & 2:
        found = "moving the sticks ends OFFBOARD"
    else:
        found = "moving the sticks does not end OFFBOARD: a pilot takes over by the mode switch"
    return [Finding("COM_RC_OVERRIDE", found)]


def _data_link(action: float | None) -> list[Finding]:
    if not action:
        return []
    return [
        Finding(
            "NAV_DLL_ACT",
            f"{action:g}: losing the ground station's heartbeat ends the flight",
            Verdict.NOTE,
            "A companion is none: keep the ground station connected, or set 0.",
        )
    ]


def _unread(subject: str, consequence: str) -> Finding:
    return Finding(
        subject,
        f"could not be read: {consequence}",
        Verdict.WARNING,
        "Look it up in a ground station.",
    )
