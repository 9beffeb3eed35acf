"""What the autopilot makes of the thrust field, and whether the vehicle's file agrees with it."""

from collections.abc import Mapping

from companion.preflight.facts import Facts, Plan
from companion.preflight.finding import Finding, ParameterChange, Verdict
from companion.preflight.names import first_of
from companion.thrust_meaning import ThrustMeaning

PX4_PARAMETERS = ("MPC_THR_HOVER",)
CLIMB = ("WP_SPD_UP", "WPNAV_SPEED_UP")
DESCENT = ("WP_SPD_DN", "WPNAV_SPEED_DN")
"""In m/s from 4.7 on, in cm/s before."""
TILT = ("ATC_ANGLE_MAX", "ANGLE_MAX")
"""In degrees from 4.7 on, in hundredths of one before."""
ARDUPILOT_PARAMETERS = (
    "GUID_OPTIONS", "ATC_ANGLE_BOOST", "MOT_THST_HOVER", *CLIMB, *DESCENT, *TILT,
)  # fmt: skip

_THRUST_AS_THRUST = 8
"""Bit of GUID_OPTIONS."""
_HOVER_SHARE = 0.15
"""The flights of the shipped gains bear this much more or less thrust."""
_OLD_UNITS = {"WPNAV_SPEED_UP": 0.01, "WPNAV_SPEED_DN": 0.01, "ANGLE_MAX": 0.01}


def judge_px4_thrust(facts: Facts, plan: Plan) -> list[Finding]:
    """Collective thrust, always; the hover thrust is what may be wrong."""
    if plan.thrust_field == "climb_rate":
        return [
            Finding(
                "thrust",
                "PX4 takes collective thrust, a climb rate is wanted (preflight.thrust_field)",
                Verdict.REFUSAL,
                "Set preflight.thrust_field to any or thrust.",
            )
        ]
    findings = [Finding("thrust", "collective; the companion makes up for the tilt")]
    return findings + _hover(facts.parameters, "MPC_THR_HOVER", plan)


def judge_ardupilot_thrust(facts: Facts, plan: Plan) -> list[Finding]:
    """Thrust or climb rate by GUID_OPTIONS, with its limits and ArduPilot's tilt limit."""
    meaning = facts.thrust
    if isinstance(meaning, str):
        return [Finding("thrust", f"cannot be flown: {meaning}", Verdict.REFUSAL)]
    parameters = facts.parameters
    findings = [_meaning(meaning, parameters, plan)]
    if meaning.kind == "climb_rate":
        findings += _rates(meaning, parameters, plan)
    else:
        findings += _hover(parameters, "MOT_THST_HOVER", plan)
    return findings + _tilt(parameters, plan)


def _meaning(meaning: ThrustMeaning, parameters: Mapping[str, float], plan: Plan) -> Finding:
    options = parameters.get("GUID_OPTIONS", 0.0)
    if meaning.kind == "climb_rate":
        found = (
            f"{options:g}: the thrust field is a climb rate, from {meaning.descent_m_s:g} m/s down "
            f"to {meaning.climb_m_s:g} m/s up; the companion sends one"
        )
    else:
        boost = (
            "ArduPilot makes up for the tilt (ATC_ANGLE_BOOST), the companion does not"
            if meaning.kind == "vertical"
            else "the companion makes up for the tilt (ATC_ANGLE_BOOST is off)"
        )
        found = f"{options:g}: the thrust field is thrust; {boost}"
    is_thrust = meaning.kind != "climb_rate"
    wanted = plan.thrust_field
    if wanted != "any" and (wanted == "thrust") != is_thrust:
        right = int(options) ^ _THRUST_AS_THRUST
        words = "thrust" if wanted == "thrust" else "a climb rate"
        return Finding(
            "GUID_OPTIONS",
            found,
            Verdict.REFUSAL,
            f"{words.capitalize()} is wanted (preflight.thrust_field). Set {right}.",
            ParameterChange(
                "GUID_OPTIONS", options, float(right), f"the thrust field means {words}"
            ),
        )
    return Finding("GUID_OPTIONS", found)


def _rates(meaning: ThrustMeaning, parameters: Mapping[str, float], plan: Plan) -> list[Finding]:
    findings = []
    for names, granted, wanted, words, key in (
        (CLIMB, meaning.climb_m_s, plan.climb_limit_m_s, "climbs", "climb_limit_m_s"),
        (DESCENT, meaning.descent_m_s, plan.descent_limit_m_s, "sinks", "descent_limit_m_s"),
    ):
        named = first_of(parameters, names)
        if named is None or granted >= wanted:
            continue
        unit = _OLD_UNITS.get(named.name, 1.0)
        findings.append(
            Finding(
                named.name,
                f"{named.value:g}: the vehicle {words} at {granted:g} m/s at most, its file says "
                f"{wanted:g} m/s",
                Verdict.WARNING,
                f"Set {wanted / unit:g}, or {key} in the vehicle's file to {granted:g}.",
                ParameterChange(
                    named.name, named.value, wanted / unit, f"the vehicle {words} as its file says"
                ),
            )
        )
    return findings


def _hover(parameters: Mapping[str, float], name: str, plan: Plan) -> list[Finding]:
    hover = parameters.get(name)
    if hover is None:
        return []
    found = f"{hover:.2f} at hover, the vehicle's file says {plan.hover_thrust:.2f}"
    if abs(hover - plan.hover_thrust) > _HOVER_SHARE * plan.hover_thrust:
        return [
            Finding(
                name,
                found,
                Verdict.WARNING,
                "One of them is wrong, or it is another vehicle: the flight begins with a jump "
                "up or down. Hover once and set hover_thrust in the vehicle's file.",
            )
        ]
    return [Finding(name, found)]


def _tilt(parameters: Mapping[str, float], plan: Plan) -> list[Finding]:
    limit = first_of(parameters, TILT)
    if limit is None:
        return []
    limit_deg = limit.value * _OLD_UNITS.get(limit.name, 1.0)
    return [
        Finding(
            limit.name,
            f"{limit_deg:g}°, which ArduPilot does not apply to attitude setpoints; the "
            f"companion's own limit is {plan.tilt_limit_deg:g}°",
        )
    ]
