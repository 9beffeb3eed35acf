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
from companion.theory.plus_certificate import PlusCertificate
from companion.theory.plus_table import print_plus_certificate

_AXES = ("x", "y", "z")
_WIDEST_SHARE, _WIDEST_HOVER_THRUST, _WIDEST_DEAD_TIME_S = 0.10, 0.02, 0.010
"""Half-widths within which a vehicle counts as known: what the gains are made to bear."""


@dataclass(frozen=True, slots=True)
class GainsVerdict:
    """What the certificate says of the gains of a controller."""

    controller: str
    holds: bool
    note: str = ""
    """Why not; empty if they hold."""
    certificate: Certificate | PlusCertificate | None = None
    """None where there is nothing to certify."""

    @classmethod
    def of(cls, controller: str, certificate: Certificate | PlusCertificate) -> "GainsVerdict":
        """As the certificate says; what is a caution in it is no failure."""
        reasons = [
            f"{axis.axis}: {condition.reason}"
            for axis in certificate.axes
            for condition in axis.conditions
            if not condition.holds
        ]
        return cls(controller, certificate.holds, "; ".join(reasons), certificate)


@dataclass(frozen=True, slots=True)
class Concluded:
    """What was made of an identification, beside the files."""

    verdicts: tuple[GainsVerdict, ...]
    """One for each controller that gains were derived for."""
    wide: tuple[str, ...]
    """What is known too roughly, in words."""
    record: Mapping[str, Any]
    """As `identify.json` has it."""

    @property
    def certified(self) -> bool:
        """The gains of every controller are."""
        return all(verdict.holds for verdict in self.verdicts)


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


def wide_figures(identified: Identified) -> tuple[str, ...]:
    """Which of the figures that the gains lean on have intervals that are too wide, in words.

    Those of the responses, the tilt gain and the hover thrust.  Drag, trim and noise are not among
    them: their intervals are wide where they are too small to matter.
    """
    said = []
    for name, estimate in estimates_of(identified):
        width = estimate.half_width_95
        if name.endswith("dead time"):
            if width > _WIDEST_DEAD_TIME_S:
                said.append(
                    f"{name} {estimate.value * 1e3:.0f} ± {width * 1e3:.0f} ms "
                    f"(wider than {_WIDEST_DEAD_TIME_S * 1e3:.0f} ms)"
                )
            continue
        if name == "hover thrust":
            widest = _WIDEST_HOVER_THRUST
        elif name.endswith(("ωn", "ζ", "gain")):
            widest = _WIDEST_SHARE
        else:
            continue
        if width > widest * abs(estimate.value):
            unit = "" if estimate.unit in ("", "1") else f" {estimate.unit}"
            said.append(
                f"{name} {estimate.value:.3g} ± {width:.2g}{unit} (wider than {widest:.0%})"
            )
    return tuple(said)


def estimates_table(identified: Identified) -> Table:
    """The figures with their 95 % intervals."""
    table = Table(box=None, pad_edge=False)
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("± 95 %", justify="right")
    table.add_column("unit")
    for name, estimate in estimates_of(identified):
        table.add_row(name, f"{estimate.value:.4g}", _width(estimate), estimate.unit)
    return table


def _width(estimate: Estimate) -> str:
    if estimate.ends_95 is None:
        return f"{estimate.half_width_95:.2g}"
    if estimate.low <= 0.0:
        return f"at most {estimate.high:.2g}"
    return f"{estimate.low:.2g} to {estimate.high:.2g}"


def print_identification(
    console: Console, identified: Identified, concluded: Concluded, *, verbose: bool
) -> None:
    """Print the figures, whether the gains are certified, what is rough, and where the files are.

    Args:
        console: where to.
        identified: what was found.
        concluded: what was made of it.
        verbose: the whole certificates.
    """
    console.print(estimates_table(identified))
    console.print()
    if verbose:
        for verdict in concluded.verdicts:
            _print_whole(console, verdict)
    for verdict in concluded.verdicts:
        if verdict.holds:
            said = f"the gains of {verdict.controller} are certified: every condition holds"
            console.print(Text(said, "green"))
        else:
            said = f"the gains of {verdict.controller} are not certified: {verdict.note}"
            console.print(Text(said, "yellow"))
    if concluded.wide:
        said = "identified, but these figures are known roughly only: " + "; ".join(concluded.wide)
        remedy = ". Fly it again in calm air, or with a larger --box"
        console.print(Text(said + remedy, "yellow"))
    for number, file in enumerate(concluded.record["files"]):
        console.print(Text(f"{'' if number else 'files:':<7}{file}"), soft_wrap=True)


def _print_whole(console: Console, verdict: GainsVerdict) -> None:
    """The certificate with its figures."""
    certificate = verdict.certificate
    if certificate is None:
        return
    title = f"{verdict.controller} on {certificate.subject.vehicle.name}"
    if isinstance(certificate, PlusCertificate):
        print_plus_certificate(console, certificate, title)
    else:
        print_certificate(console, certificate, title)
    console.print()
