"""All judgements together, in the order in which they are told."""

from companion.preflight import failsafe_ardupilot, failsafe_px4, fence, mocap, thrust
from companion.preflight.battery import judge_battery
from companion.preflight.estimator import judge_estimator
from companion.preflight.facts import Facts, Plan
from companion.preflight.failsafe_ardupilot import judge_ardupilot_failsafe
from companion.preflight.failsafe_px4 import judge_px4_failsafe
from companion.preflight.fence import judge_autopilot_fence, judge_trajectory
from companion.preflight.finding import Finding
from companion.preflight.link import judge_link
from companion.preflight.mocap import judge_mocap
from companion.preflight.streams import judge_streams
from companion.preflight.thrust import judge_ardupilot_thrust, judge_px4_thrust
from companion.preflight.vehicle import judge_vehicle

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
        *(judge_streams(facts.streams, plan) if settled else ()),
        *judge_link(facts.link, facts.identity, plan),
        *_failsafe(facts, plan),
        *_thrust(facts, plan),
        *_mocap(facts, plan),
        *judge_battery(facts.battery, plan),
        *judge_trajectory(plan),
        *judge_autopilot_fence(facts, plan),
    ]


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
