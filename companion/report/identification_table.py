"""What an identification found, for a person and for machines."""

from collections.abc import Iterator
from dataclasses import asdict, fields, is_dataclass
from typing import Any

from rich.table import Table

from companion.identification.estimates import Estimate, Identified, Response

_AXES = ("x", "y", "z")


def estimates_of(identified: Identified) -> Iterator[tuple[str, Estimate]]:
    """All figures with their names, in the order in which they are told."""
    responses = {"roll": identified.roll, "pitch": identified.pitch, "lift": identified.lift}
    for axis, response in (*responses.items(), ("climb", identified.climb)):
        if response is not None:
            yield from _of_response(axis, response)
    yield "tilt gain", identified.tilt_gain
    yield "drag k1", identified.linear_drag_1_s
    yield "drag k2", identified.quadratic_drag_1_m
    if identified.hover_thrust is not None:
        yield "hover thrust", identified.hover_thrust
    yield "loop delay", identified.loop_delay_s
    yield "loop delay, jitter", identified.loop_delay_jitter_s
    yield "trim roll", identified.trim_roll_rad
    yield "trim pitch", identified.trim_pitch_rad
    noise = identified.noise_estimates
    for words, axes in (
        ("position noise", noise.position_m),
        ("velocity noise", noise.velocity_m_s),
        ("acceleration noise", noise.acceleration_m_s2_sqrt_hz),
    ):
        for axis, estimate in zip(_AXES, axes, strict=True):
            yield f"{words} {axis}", estimate
    yield "tilt noise", noise.tilt_rad


def _of_response(axis: str, response: Response) -> Iterator[tuple[str, Estimate]]:
    yield f"{axis} ωn", response.natural_frequency_rad_s
    yield f"{axis} ζ", response.damping
    yield f"{axis} dead time", response.dead_time_s
    yield f"{axis} gain", response.gain


def estimates_table(identified: Identified) -> Table:
    """The figures with their 95 % intervals."""
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("± 95 %", justify="right")
    table.add_column("unit")
    for name, estimate in estimates_of(identified):
        table.add_row(name, f"{estimate.value:.4g}", f"{estimate.half_width_95:.2g}", estimate.unit)
    return table


def estimates_object(identified: Identified) -> dict[str, Any]:
    """The same as an object: each figure with value, half_width_95 and unit."""
    return {
        field.name: _plain(getattr(identified, field.name))
        for field in fields(identified)
        if field.name != "curves"
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - estimates, and tuples and dataclasses of them
    if isinstance(value, tuple):
        return [_plain(inner) for inner in value]
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value
