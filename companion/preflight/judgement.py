"""All judgements together, in the order in which they are told."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from companion.preflight import failsafe_ardupilot, failsafe_px4, fence, mocap, thrust
from companion.preflight.battery import judge_battery
from companion.preflight.estimator import judge_estimator
from companion.preflight.facts import Facts, Plan
from companion.preflight.failsafe_ardupilot import judge_ardupilot_failsafe
from companion.preflight.failsafe_px4 import judge_px4_failsafe
from companion.preflight.fence import judge_autopilot_fence, judge_trajectory
from companion.preflight.finding import Finding, ParameterChange, changes_of
from companion.preflight.link import judge_link
from companion.preflight.mocap import judge_mocap
from companion.preflight.streams import judge_streams
from companion.preflight.thrust import judge_ardupilot_thrust, judge_px4_thrust
from companion.preflight.vehicle import judge_vehicle
from companion.thrust_meaning import ThrustMeaning

_ROUNDS = 4
"""More do not come: each parameter is judged by itself or by the meaning of the thrust field."""

_PARAMETERS = {
    "px4": (*failsafe_px4.PARAMETERS, *thrust.PX4_PARAMETERS, *fence.PX4_PARAMETERS),
    "ardupilot": (
        *failsafe_ardupilot.PARAMETERS,
        *thrust.ARDUPILOT_PARAMETERS,
        *fence.ARDUPILOT_PARAMETERS,
    ),
}


def parameters_to_read(autopilot: str, *, with_mocap: bool) -> tuple[str, ...]:
    """Names of the autopilot's parameters that the judgements look at.

    Args:
        autopilot: its dialect's name.
        with_mocap: those of its estimator, too.
    """
    names = _PARAMETERS.get(autopilot, ())
    return (*names, *mocap.PARAMETERS.get(autopilot, ())) if with_mocap else names


def judge(facts: Facts, plan: Plan, *, settled: bool = True) -> list[Finding]:
    """Everything that can be said of what was gathered.

    Args:
        facts: what was gathered.
        plan: what is to be flown.
        settled: judge streams, estimate and readiness, too; a flight waits for them by itself.
    """
    return [
        *judge_vehicle(facts.identity),
        *(judge_estimator(facts.estimator, facts.identity) if settled else ()),
        *(judge_streams(facts.streams, plan, facts.stream_remedy) if settled else ()),
        *judge_link(facts.link, facts.identity, plan),
        *_failsafe(facts, plan),
        *_thrust(facts, plan),
        *_mocap(facts, plan),
        *judge_battery(facts.battery, plan),
        *judge_trajectory(plan),
        *_controller(plan),
        *judge_autopilot_fence(facts, plan),
    ]


def mend(
    facts: Facts,
    plan: Plan,
    thrust_meaning: Callable[[Mapping[str, float]], ThrustMeaning | str],
    *,
    settled: bool = True,
) -> tuple[list[ParameterChange], list[Finding]]:
    """The parameters to set, and what would be found once they are set.

    Setting one may show another: the hover thrust matters only where the thrust field is thrust.

    Args:
        facts: what was gathered.
        plan: what is to be flown.
        thrust_meaning: of the autopilot's parameters.
        settled: as of `judge`.
    """
    changes: dict[str, ParameterChange] = {}
    findings = judge(facts, plan, settled=settled)
    for _ in range(_ROUNDS):
        further = changes_of(findings)
        if not further:
            break
        for change in further:
            earlier = changes.get(change.name)
            changes[change.name] = replace(change, old=earlier.old) if earlier else change
        parameters = {**facts.parameters, **{change.name: change.new for change in further}}
        facts = replace(facts, parameters=parameters, thrust=thrust_meaning(parameters))
        findings = judge(facts, plan, settled=settled)
    return list(changes.values()), findings


def _failsafe(facts: Facts, plan: Plan) -> list[Finding]:
    if facts.identity.autopilot == "ardupilot":
        return judge_ardupilot_failsafe(facts.parameters, plan.our_system_id)
    return judge_px4_failsafe(facts.parameters, facts.link.clock_rate)


def _thrust(facts: Facts, plan: Plan) -> list[Finding]:
    if facts.identity.autopilot == "ardupilot":
        return judge_ardupilot_thrust(facts, plan)
    return judge_px4_thrust(facts, plan)


def _mocap(facts: Facts, plan: Plan) -> list[Finding]:
    autopilot = facts.identity.autopilot
    if not plan.mocap or autopilot not in ("px4", "ardupilot"):
        return []
    return judge_mocap("px4" if autopilot == "px4" else "ardupilot", facts.parameters)


def _controller(plan: Plan) -> list[Finding]:
    """A hint at what else can be said before flying."""
    if not plan.controller:
        return []
    found = f"{plan.controller} on {plan.vehicle}"
    if plan.certifiable:
        found += f"; `companion certify {plan.controller} --vehicle {plan.vehicle}` tells more"
    return [Finding("controller", found)]
