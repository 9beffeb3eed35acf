"""What a controller's file may say."""

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, model_validator

from companion.config.base import NonNegative, PerAxis, Positive, Section
from companion.config.l1_models import L1Config
from companion.config.plus_models import PlusConfig
from companion.config.units import unit

NonNegativePerAxis = Annotated[tuple[NonNegative, NonNegative, NonNegative], Field(strict=False)]


class PidConfig(Section):
    """A PID law, per axis (x, y, z); its derivative is of the measurement."""

    kp: NonNegativePerAxis = Field(description="Proportional gain.")
    ki: NonNegativePerAxis = Field(description="Integral gain: of kp, per second.")
    kd: NonNegativePerAxis = Field(description="Derivative gain: of kp, times seconds.")
    integral_limit: PerAxis = Field(description="Bound of the integral's part of the output.")


class OuterPidConfig(PidConfig):
    """The PID of PID-L1."""

    derivative: Literal["measurement", "error"] = Field(
        default="measurement",
        description="What D acts on; that of the error contains a derivative of y2*, a preview.",
    )


class LqrConfig(Section):
    """An LQR with integral action over D(s), per axis (x, y, z)."""

    position: PerAxis = Field(description="Weight on (y2* - y2)².")
    velocity: NonNegativePerAxis = Field(description="Weight on y1².")
    integral: PerAxis = Field(description="Weight on the squared integral of y2* - y2.")
    reference: PerAxis = Field(default=(1.0, 1.0, 1.0), description="Weight on (r2 - y2*)².")
    integral_limit: PerAxis = Field(
        description="Bound of the integral's part of r2.", json_schema_extra=unit("m")
    )
    period_s: Annotated[float, Field(ge=0.005, le=0.1)] = Field(
        default=0.01, description="Sampling time of the discretised D(s), and of the law."
    )


class MpcModelConfig(Section):
    """A second-order model ``K m / (s² + m s + K m)`` per axis: ωn² = K m, 2 ζ ωn = m."""

    m: PerAxis = Field(description="Of the model, as identified.", json_schema_extra=unit("1/s"))
    k: PerAxis = Field(description="Of the model, as identified.", json_schema_extra=unit("1/s"))


class MpcConfig(Section):
    """The outer controller."""

    period_s: Annotated[float, Field(ge=0.01, le=0.5)] = Field(
        default=0.03, description="A plan is made this often, in the autopilot's time."
    )
    horizon: Annotated[int, Field(ge=2, le=200)] = Field(
        default=30, description="N_h: how many periods a plan looks ahead."
    )
    q: Positive = Field(
        default=17.0, description="Weight on the squared tracking error (y2* - y2)²."
    )
    r: NonNegative = Field(
        default=0.08, description="Weight on the squared reference, as `penalise` says."
    )
    s: NonNegative = Field(
        default=0.02,
        description="Weight on the squared change of the reference from period to period.",
    )
    penalise: Literal["r_minus_target", "absolute_r"] = Field(
        default="r_minus_target",
        description="What r weighs: how far the reference is from the desired position, or (the "
        "letter of the paper) from the origin, which pulls there.",
    )
    r_max_m_s2: Positive = Field(
        default=160.0,
        description="Hard bound of the second difference of the reference: the paper's |r̈| ≤ "
        "r_max.",
    )
    solver: Literal["osqp", "daqp"] = Field(
        default="osqp", description="daqp: exact and quicker; pip install 'companion[daqp]'."
    )


class ThrustConfig(Section):
    """The climb-rate loop and the hover-thrust estimator."""

    proportional: Positive = Field(
        default=4.0, description="Climb-rate error to acceleration.", json_schema_extra=unit("1/s")
    )
    integral: NonNegative = Field(
        default=1.0,
        description="Integral of that error to acceleration.",
        json_schema_extra=unit("1/s²"),
    )
    maximum_acceleration_m_s2: Positive = Field(
        default=4.0, description="Largest correction, up or down."
    )
    hover_drift: Positive = Field(
        default=0.003,
        description="How quickly the thrust that hovers is reckoned to change, as a share.",
        json_schema_extra=unit("1/√s"),
    )
    acceleration_noise_m_s2: Positive = Field(
        default=0.2,
        description="Scatter of the vertical acceleration over a second: more makes the estimate "
        "of the hover thrust slower.",
    )


class YawConfig(Section):
    """The yaw law."""

    gain: Positive = Field(
        default=1.5, description="Heading error to rate.", json_schema_extra=unit("1/s")
    )
    rate_limit_rad_s: Positive = Field(
        default=1.0, description="Most that the heading is turned at."
    )
    desired: Literal["zero", "heading_at_engagement"] = Field(
        default="heading_at_engagement",
        description="zero: along the trajectory's own x axis, wherever the mission turns it.",
    )


Framework = Literal["mpc-l1", "pid-l1", "lqr-l1", "l1", "mpc-pid", "pid", "mpc-l1-plus"]

FRAMEWORK_SECTIONS: dict[Framework, tuple[str, ...]] = {
    "mpc-l1": ("mpc", "l1"),
    "pid-l1": ("outer_pid", "l1"),
    "lqr-l1": ("lqr", "l1"),
    "l1": ("l1",),
    "mpc-pid": ("mpc", "mpc_model", "inner_pid"),
    "pid": ("inner_pid",),
    "mpc-l1-plus": ("plus",),
}
"""The sections of gains that each framework reads."""


def _of_framework(schema: dict[str, Any]) -> None:
    """Tell an editor which sections go with which framework."""
    sections = {section for own in FRAMEWORK_SECTIONS.values() for section in own}
    schema["allOf"] = [
        {
            "if": {"properties": {"framework": {"const": name}}, "required": ["framework"]},
            "then": {
                "required": list(own),
                "properties": {
                    section: {
                        "type": "null",
                        "description": f"Not of {name}, which has {', '.join(own)}.",
                    }
                    for section in sorted(sections.difference(own))
                },
            },
        }
        for name, own in FRAMEWORK_SECTIONS.items()
    ]


class ControllerConfig(Section):
    """A named stack with its gains."""

    model_config = ConfigDict(json_schema_extra=_of_framework)

    framework: Framework = Field(
        description="Which laws: an outer one for the position (mpc, pid, lqr) and an inner one "
        "(l1, pid); `l1` and `pid` are given the desired position directly; mpc-l1-plus is past "
        "the paper."
    )
    source: str = Field(description="Where the numbers came from.")
    l1: L1Config | None = Field(
        default=None, description="The L1 controller; of mpc-l1, pid-l1, lqr-l1, l1."
    )
    mpc: MpcConfig | None = Field(
        default=None, description="The model predictive controller; of mpc-l1 and mpc-pid."
    )
    mpc_model: MpcModelConfig | None = Field(
        default=None, description="What the MPC takes the PID-controlled vehicle for; of mpc-pid."
    )
    outer_pid: OuterPidConfig | None = Field(
        default=None, description="r2 = y2* + PID(y2* - y2); of pid-l1."
    )
    lqr: LqrConfig | None = Field(default=None, description="The LQR; of lqr-l1.")
    inner_pid: PidConfig | None = Field(
        default=None, description="u = PID(r2 - y2); of mpc-pid and pid."
    )
    plus: PlusConfig | None = Field(default=None, description="MPC-L1+; of mpc-l1-plus.")
    thrust: ThrustConfig = Field(
        default=ThrustConfig(),
        description="The climb-rate loop, and the estimate of the thrust that hovers.",
    )
    yaw: YawConfig = Field(default=YawConfig(), description="How the heading is held.")
    fallback: str | None = Field(
        default=None,
        description="Robust controller that the in-flight monitor falls back to: a name, a YAML "
        "file beside this one, or none. Of mpc-l1-plus by default the vehicle's mpc-l1.",
    )

    @model_validator(mode="after")
    def _sections_of_the_framework(self) -> "ControllerConfig":
        wanted = FRAMEWORK_SECTIONS[self.framework]
        known = {section for sections in FRAMEWORK_SECTIONS.values() for section in sections}
        missing = [section for section in wanted if getattr(self, section) is None]
        if missing:
            raise ValueError(f"the framework {self.framework} needs '{missing[0]}'. Add it")
        for section in sorted(known.difference(wanted)):
            if getattr(self, section) is not None:
                raise ValueError(
                    f"the framework {self.framework} has no '{section}', only "
                    f"{', '.join(wanted)}. Remove it"
                )
        if "mpc" in wanted and self.l1 is not None and self.l1.m is None:
            raise ValueError("the MPC over an L1 controller needs M(s) by its m. Give l1.m")
        if self.framework == "lqr-l1" and self.l1 is not None and self.l1.m is None:
            raise ValueError("the LQR over an L1 controller needs M(s) by its m. Give l1.m")
        return self
