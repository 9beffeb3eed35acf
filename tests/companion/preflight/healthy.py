"""A vehicle with which nothing is wrong, to be made worse by tests."""

from dataclasses import replace

from companion.preflight.facts import (
    BatteryFacts,
    EstimatorFacts,
    Facts,
    Identity,
    LinkFacts,
    Plan,
    StreamFacts,
)
from companion.thrust_meaning import COLLECTIVE, ThrustMeaning

STATE = StreamFacts("ODOMETRY", 100.0, 99.0, 0.012, 0.002, 297, 3.0, is_state=True, required=True)
STATUS = StreamFacts("SYS_STATUS", 5.0, 5.0, 0.2, 0.001, 15, 3.0, required=True)
PLAN = Plan(
    our_system_id=1,
    setpoint="attitude",
    state_rate_hz=100.0,
    state_age_limit_s=0.1,
    hover_thrust=0.5,
    tilt_limit_deg=35.0,
    climb_limit_m_s=1.5,
    descent_limit_m_s=1.2,
    loop_delay_s=0.03,
    problems=(),
    reach_m=1.5,
    height_m=2.5,
)
PX4 = Facts(
    identity=Identity("px4", "1.17.0", 0xE8FF, 1, 1, "loiter", armed=False, landed_state=1),
    streams=(STATE, STATUS),
    link=LinkFacts("udpin://127.0.0.1:14540", (0.031, 0.03, 0.032), 12.3, 1.0, 1000, local=True),
    parameters={
        "COM_OF_LOSS_T": 1.0,
        "COM_OBL_RC_ACT": 0.0,
        "MPC_THR_HOVER": 0.49,
        "GF_ACTION": 2.0,
        "GF_MAX_HOR_DIST": 0.0,
        "GF_MAX_VER_DIST": 0.0,
    },
    thrust=COLLECTIVE,
    battery=BatteryFacts(0.97, 16.2),
    estimator=EstimatorFacts(0x3FF, {"velocity": 0.05}, home=True, ready=True),
)
ARDUPILOT = replace(
    PX4,
    identity=Identity("ardupilot", "4.7.0", 64495, 1, 1, "guided", armed=False, landed_state=1),
    parameters={
        "GUID_OPTIONS": 0.0,
        "GUID_TIMEOUT": 0.5,
        "FS_GCS_ENABLE": 5.0,
        "FS_GCS_TIMEOUT": 5.0,
        "MAV_GCS_SYSID": 1.0,
        "ATC_ANGLE_BOOST": 1.0,
        "MOT_THST_HOVER": 0.49,
        "WPNAV_SPEED_UP": 250.0,
        "WPNAV_SPEED_DN": 150.0,
        "ANGLE_MAX": 3000.0,
        "FENCE_ENABLE": 0.0,
    },
    thrust=ThrustMeaning("climb_rate", 2.5, 1.5),
    estimator=EstimatorFacts(0x33F, {"velocity": 0.05}, home=True, ready=True),
)


def with_parameters(facts, **values):
    """The facts with parameters changed; None takes one away."""
    changed = {**facts.parameters, **values}
    return replace(facts, parameters={k: v for k, v in changed.items() if v is not None})


def finding_of(findings, subject):
    """The one finding of a subject."""
    (found,) = [finding for finding in findings if finding.subject == subject]
    return found
