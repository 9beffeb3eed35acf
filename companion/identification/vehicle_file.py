"""Writes an identified vehicle as a person would: each figure with its interval beside it."""

import json
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from companion.config.models import DynamicsConfig, NoiseConfig, ResponseConfig, VehicleConfig
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml
from companion.identification.estimates import Estimate, Identified, Response
from companion.recording.whole_file import write_whole

_WIDTH = 98
_LIMITS = (
    "thrust_curve",
    "minimum_thrust",
    "maximum_thrust",
    "tilt_limit_deg",
    "speed_limit_m_s",
    "acceleration_limit_m_s2",
    "climb_limit_m_s",
    "descent_limit_m_s",
)
_DIGITS = 4
_LEAST = 1e-6
"""A drag or a dead time that was found to be negative is none; a rate is more than that."""


def check_name(name: str) -> None:
    """See that files can call a vehicle so.

    Raises:
        ConfigError: empty, or not one line of printable characters.
    """
    if not name.strip():
        raise ConfigError("a vehicle needs a name that is not empty: give one with --name.")
    if not name.isprintable():
        raise ConfigError(
            f"{name!r} can't be a vehicle's name: give one line of printable characters with "
            "--name."
        )


def identified_vehicle(identified: Identified, base: VehicleConfig, source: str) -> VehicleConfig:
    """What the companion knows of a vehicle after its identification.

    Args:
        identified: what was found.
        base: its name, its limits, and the hover thrust where that was not to be found.
        source: when and how it was identified.
    """
    loop_delay_s = max(0.0, identified.loop_delay_s.value)
    tilt = _of_both(identified.roll, identified.pitch)
    lift = identified.lift
    dynamics = DynamicsConfig(
        attitude=_own(tilt, loop_delay_s),
        climb=_own(identified.climb, loop_delay_s),
        lift=None if lift is None else _own(lift, loop_delay_s),
        loop_delay_s=_rounded(loop_delay_s),
        tilt_gain=_rounded(identified.tilt_gain.value),
        linear_drag_1_s=_rounded(max(0.0, identified.linear_drag_1_s.value)),
        quadratic_drag_1_m=_rounded(max(0.0, identified.quadratic_drag_1_m.value)),
    )
    hover = identified.hover_thrust
    found = {
        "source": source,
        "hover_thrust": base.hover_thrust if hover is None else _rounded(hover.value),
        "dynamics": dynamics.model_dump(),
        "noise": _rounded_noise(identified.noise).model_dump(),
    }
    return VehicleConfig(**{**base.model_dump(), **found})


def write_vehicle(
    identified: Identified, base: VehicleConfig, path: Path, source: str
) -> VehicleConfig:
    """Write the file of an identified vehicle; arguments as for `identified_vehicle`.

    Raises:
        ConfigError: the file could not be read back.
        OSError: it can't be written.
    """
    vehicle = identified_vehicle(identified, base, source)
    text = vehicle_yaml(identified, vehicle)
    validate(VehicleConfig, parse_yaml(text, path.name))
    write_whole(path, text)
    return vehicle


def vehicle_yaml(identified: Identified, vehicle: VehicleConfig) -> str:
    """The text of the file.

    Args:
        identified: what was found, for the intervals.
        vehicle: from it, by `identified_vehicle`.
    """
    dynamics, noise = vehicle.dynamics, vehicle.noise
    assert dynamics is not None
    assert noise is not None
    hover = identified.hover_thrust
    lines = [
        "# Written by `companion identify`.  Intervals (±, or from to) are of 95 %.",
        f"name: {json.dumps(vehicle.name, ensure_ascii=False)}",
        "source: >-",
        *_folded(vehicle.source),
        *_commented(
            f"hover_thrust: {vehicle.hover_thrust:g}",
            "not found: the autopilot takes a climb rate" if hover is None else _interval(hover),
        ),
    ]
    stated = VehicleConfig.model_fields
    for name in _LIMITS:
        value = getattr(vehicle, name)
        if stated[name].is_required() or value != stated[name].default:
            lines.append(f"{name}: {value:g}")
    lines += [
        "# Dead times are the vehicle's own: found in all, less the loop's.",
        "dynamics:",
        *_response(
            "attitude",
            dynamics.attitude,
            (("roll", identified.roll), ("pitch", identified.pitch)),
        ),
        *_response("climb", dynamics.climb, (("", identified.climb),)),
    ]
    if dynamics.lift is not None and identified.lift is not None:
        lines += _response("lift", dynamics.lift, (("", identified.lift),))
    jitter = f"{_interval(identified.loop_delay_s)}; from sample to sample it varies by " + _value(
        identified.loop_delay_jitter_s
    )
    for name, estimate, said in (
        ("loop_delay_s", dynamics.loop_delay_s, jitter),
        ("tilt_gain", dynamics.tilt_gain, _interval(identified.tilt_gain)),
        ("linear_drag_1_s", dynamics.linear_drag_1_s, _interval(identified.linear_drag_1_s)),
        (
            "quadratic_drag_1_m",
            dynamics.quadratic_drag_1_m,
            _interval(identified.quadratic_drag_1_m),
        ),
    ):
        lines += _commented(f"  {name}: {estimate:g}", said)
    roll, pitch = _in_degrees(identified.trim_roll_rad), _in_degrees(identified.trim_pitch_rad)
    lines.append(f"# Reported tilt at which nothing pushes: roll {roll}, pitch {pitch}.")
    if vehicle.attitude_loop is not None:
        lines.append(f"attitude_loop: {_flow(vehicle.attitude_loop.model_dump())}")
    lines += ["noise:", *_noise(noise, identified)]
    return "\n".join(lines) + "\n"


def _of_both(roll: Response, pitch: Response) -> Response:
    """The mean of roll and pitch: the companion flies both with the same gains."""
    return Response(
        _mean(roll.natural_frequency_rad_s, pitch.natural_frequency_rad_s),
        _mean(roll.damping, pitch.damping),
        _mean(roll.dead_time_s, pitch.dead_time_s),
        _mean(roll.gain, pitch.gain),
    )


def _mean(one: Estimate, other: Estimate) -> Estimate:
    width = 0.5 * math.hypot(one.half_width_95, other.half_width_95)
    return Estimate(0.5 * (one.value + other.value), width, one.unit)


def _own(response: Response, loop_delay_s: float) -> ResponseConfig:
    """Without the loop's delay."""
    return ResponseConfig(
        natural_frequency_rad_s=_rounded(response.natural_frequency_rad_s.value),
        damping=_rounded(response.damping.value),
        delay_s=_rounded(max(0.0, response.dead_time_s.value - loop_delay_s)),
    )


def _rounded_noise(noise: NoiseConfig) -> NoiseConfig:
    def three(axes: tuple[float, float, float]) -> tuple[float, float, float]:
        return (_rounded(axes[0]), _rounded(axes[1]), _rounded(axes[2]))

    return NoiseConfig(
        position_m=three(noise.position_m),
        velocity_m_s=three(noise.velocity_m_s),
        acceleration_m_s2_sqrt_hz=three(noise.acceleration_m_s2_sqrt_hz),
        tilt_rad=_rounded(noise.tilt_rad),
    )


def _rounded(value: float) -> float:
    """To as many digits as a file needs."""
    return float(f"{value:.{_DIGITS}g}") if abs(value) > _LEAST else max(0.0, value)


def _response(
    name: str, config: ResponseConfig, found: Sequence[tuple[str, Response]]
) -> list[str]:
    """A response of the file, below what was found of it."""
    lines = []
    for axis, response in found:
        said = ", ".join(
            (
                f"{_interval(response.natural_frequency_rad_s)}",
                f"ζ {_interval(response.damping)}",
                f"{_in_ms(response.dead_time_s)} in all",
                f"gain {_interval(response.gain)}",
            )
        )
        lines.append(f"  # {axis or name}: {said}")
    return [*lines, f"  {name}: {_flow(config.model_dump())}"]


def _noise(noise: NoiseConfig, identified: Identified) -> list[str]:
    found = identified.noise_estimates
    lines = []
    for name, axes in (
        ("position_m", found.position_m),
        ("velocity_m_s", found.velocity_m_s),
        ("acceleration_m_s2_sqrt_hz", found.acceleration_m_s2_sqrt_hz),
    ):
        values = ", ".join(f"{value:g}" for value in getattr(noise, name))
        lines += _commented(f"  {name}: [{values}]", _widths(axes))
    return [*lines, *_commented(f"  tilt_rad: {noise.tilt_rad:g}", _interval(found.tilt_rad))]


def _widths(axes: Sequence[Estimate]) -> str:
    """``± 1, 2, 3``, or the ends of intervals that are not symmetric."""
    if all(axis.ends_95 is None for axis in axes):
        return "± " + ", ".join(f"{axis.half_width_95:.2g}" for axis in axes)
    return ", ".join(
        f"{axis.low:.2g} to {axis.high:.2g}" if axis.low > 0.0 else f"at most {axis.high:.2g}"
        for axis in axes
    )


def _interval(estimate: Estimate) -> str:
    """``12 ± 0.3 rad/s``."""
    unit = "" if estimate.unit in ("", "1") else f" {estimate.unit}"
    return f"{estimate.value:.4g} ± {estimate.half_width_95:.2g}{unit}"


def _value(estimate: Estimate) -> str:
    return f"{estimate.value * 1e3:.2g} ms"


def _in_ms(estimate: Estimate) -> str:
    return f"{estimate.value * 1e3:.1f} ± {estimate.half_width_95 * 1e3:.1f} ms"


def _in_degrees(estimate: Estimate) -> str:
    return f"{math.degrees(estimate.value):.2f} ± {math.degrees(estimate.half_width_95):.2f}°"


def _flow(values: dict[str, float]) -> str:
    return "{" + ", ".join(f"{name}: {value:g}" for name, value in values.items()) + "}"


def _commented(line: str, remark: str) -> list[str]:
    """A line with a remark behind it, or above it where there is no room."""
    if len(line) + len(remark) + 4 <= _WIDTH:
        return [f"{line}  # {remark}"]
    indent = line[: len(line) - len(line.lstrip())]
    return [f"{indent}# {remark}", line]


def _folded(text: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
    )
