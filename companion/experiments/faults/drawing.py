"""A row's curves as an SVG that stands in a page and takes its colours from there."""

import html
import math
from collections.abc import Iterable

from companion.experiments.faults.curves import Curves, Line

_WIDTH, _LEFT, _RIGHT = 540.0, 48.0, 10.0
_BAND = (6.0, 22.0)
_ERROR = (34.0, 124.0)
_TILT = (142.0, 222.0)
_AXIS = 238.0
_HEIGHT = 246.0
_LEAST_ERROR_MM, _MOST_ERROR_MM = 50.0, 5000.0
_LEAST_TILT_DEG, _MOST_TILT_DEG = 10.0, 90.0
_SHORTEST_NAMED = 34.0
"""A phase narrower than this is not named."""


def draw(curves: Curves, title: str, tilt_limit_deg: float | None = None) -> str:
    """The `svg` element.

    Args:
        curves: of a flight.
        title: what one who can't see it is told.
        tilt_limit_deg: a line at the vehicle's limit.
    """
    canvas = _Canvas(curves)
    errors = [value for line in curves.error_mm for _, value in line]
    tilts = [value for line in (*curves.commanded_deg, curves.true_deg) for _, value in line]
    top_error = _nice(min(max([_LEAST_ERROR_MM, *errors]), _MOST_ERROR_MM))
    top_tilt = _nice(min(max([_LEAST_TILT_DEG, *tilts]), _MOST_TILT_DEG))
    parts = [
        *canvas.phases(),
        *canvas.frame(_ERROR, top_error, "error, mm"),
        *canvas.frame(_TILT, top_tilt, "tilt, °"),
        canvas.lines([curves.true_deg], _TILT, top_tilt, "true"),
        canvas.lines(curves.commanded_deg, _TILT, top_tilt, "commanded"),
        canvas.lines(curves.error_mm, _ERROR, top_error, "error"),
    ]
    if tilt_limit_deg is not None and tilt_limit_deg <= top_tilt:
        level = ((curves.begins_s, tilt_limit_deg), (curves.ends_s, tilt_limit_deg))
        parts.append(canvas.lines([level], _TILT, top_tilt, "limit"))
    for time_s, name in (
        (curves.fault_s, "fault"),
        (curves.seen_s, "seen"),
        (curves.over_s, "over"),
    ):
        if time_s is not None:
            parts.append(canvas.moment(time_s, name))
    parts += canvas.ticks()
    body = "".join(parts)
    return (
        f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" class="flight">'
        f"<title>{html.escape(title)}</title>{body}</svg>"
    )


class _Canvas:
    def __init__(self, curves: Curves) -> None:
        self._curves = curves
        span_s = max(curves.ends_s - curves.begins_s, 1e-6)
        self._scale = (_WIDTH - _LEFT - _RIGHT) / span_s

    def x(self, time_s: float) -> float:
        return _LEFT + (time_s - self._curves.begins_s) * self._scale

    def phases(self) -> list[str]:
        """A band that says what the flight did when."""
        top, bottom = _BAND
        phases = self._curves.phases
        ends = [*(time for time, _ in phases[1:]), self._curves.ends_s]
        parts = []
        for number, ((begin_s, name), end_s) in enumerate(zip(phases, ends, strict=True)):
            left, right = self.x(begin_s), self.x(end_s)
            parts.append(
                f'<rect class="phase p{number % 2}" x="{left:.1f}" y="{top:g}" '
                f'width="{max(0.0, right - left):.1f}" height="{bottom - top:g}"/>'
            )
            if right - left >= max(_SHORTEST_NAMED, 6.2 * len(name)):
                parts.append(
                    f'<text class="name" x="{(left + right) / 2:.1f}" y="{bottom - 5:g}">'
                    f"{html.escape(name)}</text>"
                )
        return parts

    def frame(self, place: tuple[float, float], top: float, label: str) -> list[str]:
        """Axes of a strip: zero, its largest value, and what it shows."""
        upper, lower = place
        middle, width, height = (upper + lower) / 2, _WIDTH - _LEFT - _RIGHT, lower - upper
        box = f'x="{_LEFT:g}" y="{upper:g}" width="{width:g}" height="{height:g}"'
        return [
            f'<rect class="strip" {box}/>',
            f'<text class="value" x="{_LEFT - 5:g}" y="{upper + 9:g}">{top:g}</text>',
            f'<text class="value" x="{_LEFT - 5:g}" y="{lower:g}">0</text>',
            f'<text class="label" transform="translate(12 {middle:g}) rotate(-90)">{label}</text>',
        ]

    def lines(
        self, lines: Iterable[Line], place: tuple[float, float], top: float, kind: str
    ) -> str:
        """Lines in a strip, cut off at its top."""
        upper, lower = place
        path = []
        for line in lines:
            points = [
                f"{self.x(time_s):.1f} {lower - min(value, top) / top * (lower - upper):.1f}"
                for time_s, value in line
            ]
            if points:
                path.append("M" + "L".join(points))
        return f'<path class="{kind}" d="{"".join(path)}"/>' if path else ""

    def moment(self, time_s: float, name: str) -> str:
        """A line across all strips."""
        x = self.x(time_s)
        return (
            f'<path class="moment {name}" d="M{x:.1f} {_BAND[0]:g}V{_TILT[1]:g}"/>'
            f'<text class="moment-name {name}" x="{x + 3:.1f}" '
            f'y="{_ERROR[0] + (10 if name == "fault" else 22 if name == "seen" else 34):g}">'
            f"{name}</text>"
        )

    def ticks(self) -> list[str]:
        """The time below."""
        begin_s, end_s = self._curves.begins_s, self._curves.ends_s
        step_s = _nice((end_s - begin_s) / 10.0)
        first = math.ceil(begin_s / step_s)
        last = math.floor(end_s / step_s)
        return [
            f'<text class="tick" x="{self.x(k * step_s):.1f}" y="{_AXIS:g}">{k * step_s:g}'
            f"{' s' if k == last else ''}</text>"
            for k in range(first, last + 1)
        ]


def _nice(value: float) -> float:
    """The next 1, 2, 3, 4, 5, 6 or 8 times a power of ten."""
    scale = 10.0 ** math.floor(math.log10(value))
    return next(k * scale for k in (1, 2, 3, 4, 5, 6, 8, 10) if k * scale >= value * (1 - 1e-9))
