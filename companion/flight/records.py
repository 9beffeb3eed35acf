"""The records of a flight: what each tick and each plan says about itself.

The field tables make the log's schemas; the functions fill them.
"""

import math
from typing import Any

from companion.control.frameworks import StackRecord
from companion.control.mpc import MpcRecord
from companion.control.pid import PidTerms
from companion.flight.setpoints.control_loop import Output
from companion.flight.setpoints.stack_runner import Watch
from companion.frames import Vector3
from companion.recording.schema import ChannelSpec, Field
from companion.vehicle_state import VehicleState

CONTROL = ChannelSpec(
    "control",
    (
        Field("autopilot_time_s", description="autopilot's clock at the sample"),
        Field("received_s", description="loop's clock at the sample's arrival"),
        Field("loop_delay_s", description="from the sample's time until its setpoint acts"),
        Field("latency_s", description="from the sample's arrival to its setpoint's departure"),
        Field("computed_us", description="processing of the sample by the controller"),
        Field("phase", "string"),
        Field("rung", "string", "rung of the supervisor's ladder"),
        Field("fallback", "string", "fallback in use, empty for none"),
        Field("reason", "string", "why not the top rung"),
        Field("position_enu_m", "array", "as reported"),
        Field("velocity_enu_m_s", "array", "as reported"),
        Field("attitude_flu_to_enu", "array", "as reported"),
        Field("rate_flu_rad_s", "array", "as reported"),
        Field("desired_enu_m", "array", "y2*, the reference at the sample's time"),
        Field("attitude_setpoint_flu_to_enu", "array"),
        Field("rate_setpoint_flu_rad_s", "array", "sent in place of the attitude, if rates are"),
        Field("thrust", description="thrust field of the setpoint, 0..1"),
        Field(
            "hover_thrust",
            description="estimated thrust field at hover, 0..1; null where the field is a climb "
            "rate",
        ),
        Field("r2_enu_m", "array", "position reference from the outer controller"),
        Field("r1_enu_m_s", "array", "velocity reference of the L1 controller"),
        Field("u", "array", "output of the L1 controller: sines of the tilt, climb rate in m/s"),
        Field("applied_u", "array", "u after its limits"),
        Field("y_tilde_m_s", "array", "prediction error of the velocity"),
        Field("sigma_hat", "array", "adaptive estimate, in the unit of u"),
        Field("projecting", "boolean", "the projection held the estimate back"),
        Field("roll_rad", description="commanded, FLU"),
        Field("pitch_rad", description="commanded, FLU: positive is nose down"),
        Field("controller", "string", "that flew the tick; empty while holding"),
        Field("monitor", "string", "nominal, reduced, robust; failed; empty where nobody watches"),
        Field("y_tilde_bound_m_s", "array", "of |y_tilde|, by the controller"),
        Field("sigma_bound", "array", "of the projection"),
        Field("y_tilde_gauge", description="rms of y_tilde over its bound"),
        Field("sigma_gauge", description="mean of |sigma_hat| over its bound"),
        Field("slew_gauge", description="rms rate of the commanded tilt over its bound"),
        Field("slew_bound_rad_s", description="that bound: it follows the trajectory"),
        Field("delay_gauge", description="loop delay beyond the stated one, over its bound"),
        Field("segment", "string", "part of an experiment; empty in an ordinary flight"),
        Field("left", "string", "which part of an experiment is not flown in its time, and why"),
        Field("state_age_s", description="of a step in silence: since the newest usable sample"),
        Field("unusable", "string", "of a step in silence: what was wrong with what came"),
        Field("sent", "boolean", "a setpoint left"),
    ),
    "one record for each sample of the state while setpoints flow, and for each step taken in "
    'silence (phase "silence", without a state)',
)

PLAN = ChannelSpec(
    "plan",
    (
        Field("autopilot_time_s", description="autopilot's clock at the sample"),
        Field("status", "string", "how the reference came about"),
        Field("constrained_axes", "array", "1 on axes whose closed form violated a constraint"),
        Field("r_max_active", "boolean", "the bound on the second difference was violated"),
        Field("solver_status", "string"),
        Field("solver_iterations", "integer"),
        Field("predicted_end_enu_m", "array", "where the plan ends"),
    ),
    "one record for each run of the outer controller",
)

FEEDBACK = ChannelSpec(
    "feedback",
    (
        Field("autopilot_time_s", description="autopilot's clock at the sample"),
        Field("proportional_m", "array", "part of r2 - y2*"),
        Field("integral_m", "array", "part of r2 - y2*"),
        Field("derivative_m", "array", "part of r2 - y2*"),
    ),
    "one record for each run of an outer controller without a plan",
)

EVENT = ChannelSpec(
    "event",
    (Field("severity", "string"), Field("text", "string")),
    "what a person was told",
)

INPUT = ChannelSpec(
    "input",
    (
        Field("kind", "string", "adopt, start, engage or hold"),
        Field("values", "object", "exact, as the control loop was given them"),
    ),
    "what the control loop is told besides samples, for the replay",
)

CONFIGURATION = ChannelSpec(
    "configuration",
    (
        Field("mission", "object"),
        Field("vehicle", "object"),
        Field("controller", "object"),
        Field("others", "object", "controllers that the flight may be handed over to"),
        Field("trajectory_file", "string", "its text; empty for one of the test trajectories"),
        Field("replayable", "boolean", "the setpoints follow from what is recorded"),
        Field("made_by", "object", "versions and machine"),
    ),
    "all that the flight was told, once at its beginning",
)

CHANNELS = (CONTROL, PLAN, FEEDBACK, EVENT, INPUT, CONFIGURATION)

_NO_VECTOR = (math.nan,) * 3
_NO_QUATERNION = (math.nan,) * 4


def control_record(
    state: VehicleState,
    output: Output,
    desired_m: Vector3 | None,
    phase: str,
    timing_s: tuple[float, float, float],
    computed_us: float,
    sent: bool,
) -> dict[str, Any]:
    """Record of a tick.

    Args:
        state: the sample.
        output: what was decided on it.
        desired_m: reference at its time.
        phase: of the flight.
        timing_s: arrival, loop delay, latency.
        computed_us: processing time.
        sent: a setpoint left.
    """
    received_s, delay_s, latency_s = timing_s
    return {
        "autopilot_time_s": state.time_s,
        "received_s": received_s,
        "loop_delay_s": delay_s,
        "latency_s": latency_s,
        "computed_us": computed_us,
        "phase": phase,
        "rung": output.rung.value,
        "fallback": output.fallback,
        "reason": output.reason,
        "position_enu_m": state.position_enu_m,
        "velocity_enu_m_s": state.velocity_enu_m_s,
        "attitude_flu_to_enu": state.attitude_flu_to_enu,
        "rate_flu_rad_s": state.rate_flu_rad_s,
        "desired_enu_m": _NO_VECTOR if desired_m is None else desired_m,
        "attitude_setpoint_flu_to_enu": output.attitude_flu_to_enu or _NO_QUATERNION,
        "rate_setpoint_flu_rad_s": output.rate_flu_rad_s or _NO_VECTOR,
        "thrust": output.thrust,
        "state_age_s": 0.0,
        "unusable": "",
        "sent": sent,
        **(_NO_STACK if output.stack is None else _stack_fields(output.stack)),
        **(_NO_WATCH if output.watch is None else _watch_fields(output.watch)),
    }


def silence_record(
    autopilot_time_s: float,
    now_s: float,
    state_age_s: float,
    unusable: str,
    output: Output,
    sent: bool,
) -> dict[str, Any]:
    """Record of a tick at which no sample could be flown on: what was sent, and why.

    Args:
        autopilot_time_s: the autopilot's clock, estimated.
        now_s: the loop's clock.
        state_age_s: since the newest usable sample arrived.
        unusable: what was wrong with what came; empty if nothing came.
        output: what was decided.
        sent: a setpoint left.
    """
    return {
        "autopilot_time_s": autopilot_time_s,
        "received_s": now_s,
        "loop_delay_s": math.nan,
        "latency_s": math.nan,
        "computed_us": math.nan,
        "phase": "silence",
        "rung": output.rung.value,
        "fallback": output.fallback,
        "reason": output.reason,
        "position_enu_m": _NO_VECTOR,
        "velocity_enu_m_s": _NO_VECTOR,
        "attitude_flu_to_enu": _NO_QUATERNION,
        "rate_flu_rad_s": _NO_VECTOR,
        "desired_enu_m": _NO_VECTOR,
        "attitude_setpoint_flu_to_enu": output.attitude_flu_to_enu or _NO_QUATERNION,
        "rate_setpoint_flu_rad_s": output.rate_flu_rad_s or _NO_VECTOR,
        "thrust": output.thrust,
        "state_age_s": state_age_s,
        "unusable": unusable,
        "sent": sent,
        **_NO_STACK,
        **_NO_WATCH,
    }


def _watch_fields(watch: Watch) -> dict[str, Any]:
    y_tilde, sigma, slew, delay = watch.gauges
    return {
        "controller": watch.controller,
        "monitor": watch.monitor,
        "y_tilde_gauge": y_tilde,
        "sigma_gauge": sigma,
        "slew_gauge": slew,
        "slew_bound_rad_s": watch.slew_bound_rad_s,
        "delay_gauge": delay,
    }


_NO_WATCH = _watch_fields(Watch("", ""))


def _stack_fields(stack: StackRecord) -> dict[str, Any]:
    inner = stack.inner
    return {
        "hover_thrust": stack.hover_thrust,
        "r2_enu_m": stack.r2_m.tolist(),
        "r1_enu_m_s": inner.r1_m_s.tolist(),
        "u": inner.u.tolist(),
        "applied_u": stack.applied_u.tolist(),
        "y_tilde_m_s": inner.y_tilde_m_s.tolist(),
        "sigma_hat": inner.sigma_hat.tolist(),
        "y_tilde_bound_m_s": inner.y_tilde_bound_m_s.tolist(),
        "sigma_bound": inner.sigma_bound.tolist(),
        "projecting": inner.projecting,
        "roll_rad": stack.roll_rad,
        "pitch_rad": stack.pitch_rad,
        "segment": stack.segment,
        "left": stack.left,
    }


_NO_STACK: dict[str, Any] = {
    "hover_thrust": math.nan,
    "r2_enu_m": _NO_VECTOR,
    "r1_enu_m_s": _NO_VECTOR,
    "u": _NO_VECTOR,
    "applied_u": _NO_VECTOR,
    "y_tilde_m_s": _NO_VECTOR,
    "sigma_hat": _NO_VECTOR,
    "y_tilde_bound_m_s": _NO_VECTOR,
    "sigma_bound": _NO_VECTOR,
    "projecting": False,
    "roll_rad": math.nan,
    "pitch_rad": math.nan,
    "segment": "",
    "left": "",
}


def plan_record(autopilot_time_s: float, plan: MpcRecord) -> dict[str, Any]:
    """Record of a run of the outer controller."""
    predicted = plan.predicted_position_m
    return {
        "autopilot_time_s": autopilot_time_s,
        "status": plan.status,
        "constrained_axes": [int(axis) for axis in plan.constrained_axes],
        "r_max_active": plan.r_max_active,
        "solver_status": plan.solver_status,
        "solver_iterations": plan.iterations,
        "predicted_end_enu_m": predicted[-1].tolist() if len(predicted) else _NO_VECTOR,
    }


def feedback_record(autopilot_time_s: float, terms: PidTerms) -> dict[str, Any]:
    """Record of a run of an outer controller without a plan."""
    return {
        "autopilot_time_s": autopilot_time_s,
        "proportional_m": terms.proportional.tolist(),
        "integral_m": terms.integral.tolist(),
        "derivative_m": terms.derivative.tolist(),
    }
