"""The trajectory against our geofence, the vehicle's limits, and the autopilot's own fence."""

from collections.abc import Mapping

from companion.preflight.facts import Facts, Plan
from companion.preflight.finding import Finding, Verdict

PX4_PARAMETERS = ("GF_ACTION", "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST")
ARDUPILOT_PARAMETERS = (
    "FENCE_ENABLE", "FENCE_TYPE", "FENCE_ALT_MAX", "FENCE_RADIUS",
)  # fmt: skip

_MARGIN_M = 1.0
"""What the flight may be off, and the fence's own margin, together."""
_ALTITUDE, _CIRCLE, _POLYGON = 1, 2, 4
"""Bits of FENCE_TYPE."""


def judge_trajectory(plan: Plan) -> list[Finding]:
    """Whether the trajectory fits the vehicle and our geofence."""
    if plan.problems:
        return [Finding("trajectory", text, Verdict.REFUSAL) for text in plan.problems]
    return [
        Finding(
            "trajectory",
            f"fits the vehicle and the geofence; up to {plan.reach_m:.1f} m from take-off, "
            f"{plan.height_m:.1f} m high",
        )
    ]


def judge_autopilot_fence(facts: Facts, plan: Plan) -> list[Finding]:
    """Whether the autopilot's own fence, if it is on, would take the vehicle over on the way."""
    if facts.identity.autopilot == "px4":
        return _px4(facts.parameters, plan)
    return _ardupilot(facts.parameters, plan)


def _px4(parameters: Mapping[str, float], plan: Plan) -> list[Finding]:
    action = parameters.get("GF_ACTION")
    if action is None:
        return []
    radius_m = parameters.get("GF_MAX_HOR_DIST", 0.0)
    ceiling_m = parameters.get("GF_MAX_VER_DIST", 0.0)
    if not action or not (radius_m or ceiling_m):
        return [Finding("GF_ACTION", "PX4 has no fence about home")]
    limits = (
        ("GF_MAX_HOR_DIST", radius_m or None, plan.reach_m),
        ("GF_MAX_VER_DIST", ceiling_m or None, plan.height_m),
    )
    return [_limit("PX4", name, limit, reach) for name, limit, reach in limits if limit is not None]


def _ardupilot(parameters: Mapping[str, float], plan: Plan) -> list[Finding]:
    enabled = parameters.get("FENCE_ENABLE")
    if enabled is None:
        return []
    if not enabled:
        return [Finding("FENCE_ENABLE", "ArduPilot's own fence is off")]
    kinds = int(parameters.get("FENCE_TYPE", 0.0))
    findings = []
    for kind, name, reach_m in (
        (_ALTITUDE, "FENCE_ALT_MAX", plan.height_m),
        (_CIRCLE, "FENCE_RADIUS", plan.reach_m),
    ):
        if kinds & kind and name in parameters:
            findings.append(_limit("ArduPilot", name, parameters[name], reach_m))
    if kinds & _POLYGON:
        findings.append(
            Finding(
                "FENCE_TYPE",
                "ArduPilot's fence has polygons, which are not compared with the trajectory",
                Verdict.NOTE,
                "Look at them in a ground station, if any are uploaded.",
            )
        )
    return findings or [Finding("FENCE_ENABLE", "ArduPilot's own fence is on, without limits")]


def _limit(whose: str, name: str, limit_m: float, reach_m: float) -> Finding:
    found = f"{limit_m:g} m, the trajectory reaches {reach_m:.1f} m"
    if reach_m + _MARGIN_M > limit_m:
        return Finding(
            name,
            found,
            Verdict.REFUSAL,
            f"{whose}'s own fence would take the vehicle over. Widen it, or move the trajectory.",
        )
    return Finding(name, found)
