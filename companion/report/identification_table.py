"""What an identification found, as a table."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from companion.identification.estimates import Estimate, Identified, Response
from companion.theory.certificate import Certificate
from companion.theory.certificate_table import print_certificate

_AXES = ("x", "y", "z")


@dataclass(frozen=True, slots=True)
class Concluded:
    """What was made of an identification, beside the files."""

    certified: bool
    note: str
    """Why not; empty if it is."""
    certificate: Certificate | None
    record: Mapping[str, Any]
    """As `identify.json` has it."""


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


def print_identification(
    console: Console, identified: Identified, concluded: Concluded, *, verbose: bool
) -> None:
    """Print the figures, whether the gains are certified, and where the files are.

    Args:
        console: where to.
        identified: what was found.
        concluded: what was made of it.
        verbose: the whole certificate.
    """
    console.print(estimates_table(identified))
    console.print()
    certificate = concluded.certificate
    if verbose and certificate is not None:
        print_certificate(console, certificate, f"mpc-l1 on {certificate.subject.vehicle.name}")
        console.print()
    if concluded.certified:
        console.print(Text("the gains of mpc-l1 are certified: every condition holds", "green"))
    else:
        note = Text(f"the gains of mpc-l1 are not certified: {concluded.note}", "yellow")
        console.print(note, soft_wrap=True)
    console.print(Text("files: " + ", ".join(concluded.record["files"])), soft_wrap=True)
