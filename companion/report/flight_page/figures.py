"""The figures of a flight's page, as SVG that takes the page's colours."""

from collections.abc import Callable
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from companion.report.flight_data import Array
from companion.report.flight_page.draw_path import draw_path
from companion.report.flight_page.drawing import (
    AXIS_COLOURS,
    BLOWS,
    FLOWN,
    FOUND,
    OTHER,
    TROUBLE,
    Scene,
    caption,
    draw_band,
    draw_limit,
    label_time,
    panels,
    prepare,
)
from companion.report.metrics import reported_error, true_error
from companion.report.pages.inline_svg import inline_svg
from companion.report.pages.style import AXES, INK, MUTED, SETTINGS, SMALL, thin
from companion.report.pages.svg import svg_text

_DEADLINE_MS = 5.0
_GAUGES = (("|ỹ|", OTHER), ("|σ̂|", FOUND), ("slew", FLOWN), ("delay", MUTED))
_TOP_GAUGE = 2.2


@dataclass(frozen=True, slots=True)
class DrawnFigure:
    """A figure of the page."""

    name: str
    title: str
    caption: str
    svg: str


def draw_figures(scene: Scene) -> tuple[DrawnFigure, ...]:
    """All that there is something to draw in."""
    ticks = scene.story.data.ticks
    if len(ticks.time_s) < 2:
        return ()
    flown = np.isfinite(ticks.u).all(axis=1)
    wanted: list[tuple[str, str, str, Callable[[Scene], Figure]]] = []
    if np.isfinite(ticks.position_enu_m).all(axis=1).any():
        wanted.append(("path", "The path, from above and from the side", _PATH, draw_path))
    if np.isfinite(ticks.desired_enu_m).all(axis=1).any():
        wanted.append(("error", "Tracking error", _ERROR, _draw_error))
    if flown.any():
        wanted += [
            ("tilt-thrust", "Tilt and thrust", _TILT, _draw_commands),
            ("adaptation", "What the adaptation saw: ỹ and σ̂", _ADAPTATION, _draw_adaptation),
        ]
    timing = _TIMING_REAL if scene.real_time else _TIMING
    wanted.append(("timing", "Computing time and age of the state", timing, _draw_timing))
    if ticks.watched is not None and np.isfinite(ticks.watched.gauges).any():
        wanted.append(("monitor", "The in-flight monitor", _MONITOR, _draw_monitor))
    with mpl.rc_context(SETTINGS):
        return tuple(
            DrawnFigure(name, title, text, inline_svg(svg_text(draw(scene)), name, title))
            for name, title, text, draw in wanted
        )


_SHADED = (
    "Shaded: the part that is scored. Dotted: a phase begins. Red ground: a fallback was flown."
)
_PATH = (
    "Desired (dashed) and flown path while tracking was scored (of a flight that never tracked: "
    "all of it), in metres, to one scale; above seen from above, below from the south. The flown "
    "one is the true one where a simulation tells it."
)
_ERROR = (
    "Distance between the desired and the vehicle's position, mm: true where a simulation tells "
    f"it, and as the autopilot reported it, with the mean while scored and what the wind did. The "
    f"scale is that of the scored part. {_SHADED}"
)
_TILT = (
    "Commanded roll and pitch in degrees with the vehicle's limit (dashed), and the thrust field "
    f"with its limits and the estimate for hover. {_SHADED}"
)
_ADAPTATION = (
    "Left, ỹ: the error of the predicted velocity, m/s; right, σ̂: the adaptive estimate, in the "
    "units of u (x, y: sine of a tilt; z: m/s). Line: mean of short blocks; band: their range; "
    "dashed: the bound that the controller states for it, where it is near enough to be drawn."
)
_MONITOR = (
    "Each gauge over its bound: at 1 the monitor goes over to a more robust controller. Red lines: "
    "another controller took over."
)
_TIMING = (
    "Computing time of each tick, µs (logarithmic), and the age of the state that a setpoint acts "
    "on: from its time stamp until the setpoint acts, ms. In simulated time nothing waits for the "
    "computing."
)
_TIMING_REAL = (
    "Computing time of each tick, µs (logarithmic); from a sample's arrival to its setpoint's "
    "departure, ms, with the deadline of 5 ms; and the age of the state that a setpoint acts on."
)


def _draw_error(scene: Scene) -> Figure:
    (axes,) = panels(3.0, 1)
    prepare(axes, scene, named=True)
    data = scene.story.data
    times = data.ticks.time_s
    whole = (float(times[0]), float(times[-1]))
    at_s, reported = reported_error(data, whole)
    best_s, best = true_error(data, whole)
    is_true = len(best) > 0
    if is_true:
        axes.plot(*thin(at_s - scene.origin_s, reported * 1e3), color=MUTED, lw=0.7,
                  label="as reported")  # fmt: skip
    else:
        best_s, best = at_s, reported
    axes.plot(*thin(best_s - scene.origin_s, best * 1e3), color=FLOWN, lw=1.2,
              label="true" if is_true else "as reported")  # fmt: skip
    inside = best[scene.scored(best_s)] * 1e3
    if len(inside):
        axes.set_ylim(0.0, 1.3 * max(float(inside.max()), 1e-3))
        if scene.scored_s is not None:
            axes.axhline(float(inside.mean()), color=INK, lw=0.9, ls=":", label="mean")
    _draw_wind(axes, scene)
    if scene.peak is not None:
        x, y = scene.peak.since_start_s, scene.peak.error_mm
        axes.plot([x], [y], "o", ms=5, color=TROUBLE, zorder=5)
        late = x > 0.6 * axes.get_xlim()[1]
        axes.annotate(
            f"{y:.1f} mm at {x:.1f} s", (x, y), xytext=(-7 if late else 7, 4),
            textcoords="offset points", ha="right" if late else "left", color=TROUBLE,
            fontsize=SMALL,
        )  # fmt: skip
    caption(axes, "mm")
    label_time(axes, scene)
    return _figure(axes)


def _draw_wind(axes: Axes, scene: Scene) -> None:
    """The wind's push along the bottom, a quarter of the height at its most."""
    truth = scene.story.data.truth
    wind = truth.wind_acceleration_m_s2
    if not len(wind) or not wind.max() > 0.0:
        return
    times, push = thin(truth.wind_time_s - scene.origin_s, wind, 200)
    height = 0.22 * axes.get_ylim()[1] / float(wind.max())
    label = f"wind, up to {wind.max():.1f} m/s²"
    axes.fill_between(times, push * height, color=BLOWS, alpha=0.3, lw=0, label=label)


def _draw_commands(scene: Scene) -> Figure:
    tilt, thrust = panels(4.0, 2)
    ticks, times = scene.story.data.ticks, scene.times_s
    prepare(tilt, scene)
    limit = scene.limits.tilt_deg
    for values, colour, name in (
        (ticks.roll_rad, AXIS_COLOURS[1], "roll"),
        (ticks.pitch_rad, AXIS_COLOURS[0], "pitch"),
    ):
        tilt.plot(*thin(times, np.degrees(values)), color=colour, lw=0.9, label=name)
    draw_limit(tilt, limit, "limit")
    draw_limit(tilt, -limit, None)
    tilt.set_ylim(-1.15 * limit, 1.15 * limit)
    caption(tilt, "commanded tilt, °")
    prepare(thrust, scene, named=False)
    thrust.plot(*thin(times, ticks.thrust), color=MUTED, lw=0.7, label="setpoint")
    if np.isfinite(ticks.hover_thrust).any():
        thrust.plot(*thin(times, ticks.hover_thrust), color=FLOWN, lw=1.3, label="for hover")
        draw_limit(thrust, scene.limits.maximum_thrust, "limits")
        draw_limit(thrust, scene.limits.minimum_thrust, None)
    thrust.set_ylim(0.0, 1.0)
    caption(thrust, "thrust field, 0 … 1")
    label_time(thrust, scene)
    return _figure(tilt)


def _draw_adaptation(scene: Scene) -> Figure:
    axes = panels(4.4, 3, 2, hspace=0.22)
    ticks, said, times = scene.story.data.ticks, scene.story.said, scene.times_s
    shown = (
        (ticks.y_tilde_m_s, said.y_tilde_bound_m_s, "ỹ, m/s"),
        (ticks.sigma_hat, said.sigma_bound, "σ̂"),
    )
    for row in range(3):
        for column, (values, bounds, name) in enumerate(shown):
            one = axes[2 * row + column]
            prepare(one, scene)
            draw_band(one, times, values[:, row], AXIS_COLOURS[row], AXES[row])
            _draw_bound(one, times, values[:, row], bounds[:, row])
            one.text(0.02, 0.04, AXES[row], transform=one.transAxes, va="bottom", color=INK)
            if row == 0:
                caption(one, name)
                legend = one.get_legend()
                if legend is not None:
                    legend.remove()
            if row == 2:
                label_time(one, scene)
    return _figure(axes[0])


def _draw_bound(axes: Axes, times_s: Array, values: Array, bound: Array) -> None:
    """Both signs of a bound, if they are not so far off that nothing else could be seen."""
    known = np.abs(values[np.isfinite(values)])
    limit = bound[np.isfinite(bound)]
    if not len(known) or not len(limit):
        return
    reach, far = float(known.max()), float(limit.max())
    if far <= 4.0 * reach:
        for sign in (1.0, -1.0):
            axes.plot(*thin(times_s, sign * bound, 100), color=INK, lw=0.9, ls=(0, (4, 2)))
        reach = max(reach, far)
    else:
        axes.text(0.98, 0.94, f"bound ±{far:.3g}", transform=axes.transAxes, ha="right", va="top",
                  fontsize=SMALL - 1, color=MUTED)  # fmt: skip
    axes.set_ylim(-1.45 * reach - 1e-9, 1.25 * reach + 1e-9)


def _draw_monitor(scene: Scene) -> Figure:
    (axes,) = panels(2.6, 1)
    prepare(axes, scene)
    watched, times = scene.story.data.ticks.watched, scene.times_s
    assert watched is not None
    for k, (name, colour) in enumerate(_GAUGES):
        if np.isfinite(watched.gauges[:, k]).any():
            axes.plot(*thin(times, watched.gauges[:, k]), color=colour, lw=1.1, label=name)
    draw_limit(axes, 1.0, "bound")
    known = watched.gauges[np.isfinite(watched.gauges)]
    axes.set_ylim(0.0, min(_TOP_GAUGE, max(1.15, 1.1 * float(known.max()))))
    flies = watched.controller != ""
    names, when = watched.controller[flies], times[flies]
    for row, k in enumerate((np.flatnonzero(names[1:] != names[:-1]) + 1).tolist()):
        axes.axvline(when[k], color=TROUBLE, lw=1.0)
        axes.text(when[k], (0.93 - 0.12 * (row % 3)) * axes.get_ylim()[1], f" {names[k]}",
                  fontsize=SMALL - 0.5, color=TROUBLE, va="top", clip_on=True)  # fmt: skip
    caption(axes, "gauge over its bound", columns=5)
    label_time(axes, scene)
    return _figure(axes)


def _draw_timing(scene: Scene) -> Figure:
    rows = 3 if scene.real_time else 2
    made = panels(1.55 * rows + 0.5, rows)
    ticks, said, times = scene.story.data.ticks, scene.story.said, scene.times_s
    computing, age = made[0], made[-1]
    for axes in made:
        prepare(axes, scene)
    timed = ticks.computed_us > 0.0
    kinds = (
        ("without a plan", MUTED, ticks.plan == ""),
        ("closed form", FLOWN, ticks.plan == "closed_form"),
        ("constraint active", OTHER, ticks.plan == "solved"),
        ("fallback", TROUBLE, np.isin(ticks.plan, ("shifted_plan", "clipped_closed_form"))),
    )
    for name, colour, use in kinds:
        use = use & timed
        if use.any():
            computing.plot(*thin(times[use], ticks.computed_us[use], 200), ".", ms=2.0,
                           color=colour, label=name)  # fmt: skip
    if timed.any():
        computing.set_yscale("log")
        low, high = (float(f(ticks.computed_us[timed])) for f in (np.min, np.max))
        computing.set_ylim(0.7 * low, 1.4 * high)
        computing.minorticks_off()
    caption(computing, "computing, µs")
    if scene.real_time:
        latency = said.latency_s * 1e3
        made[1].plot(*thin(times, latency), color=FLOWN, lw=0.8, label="arrival to departure")
        draw_limit(made[1], _DEADLINE_MS, "deadline")
        known = latency[np.isfinite(latency)]
        top = float(np.percentile(known, 99.9)) if len(known) else 0.0
        made[1].set_ylim(0.0, 1.2 * max(top, _DEADLINE_MS))
        caption(made[1], "latency, ms")
    age.plot(*thin(times, said.loop_delay_s * 1e3), color=FLOWN, lw=0.8, label="until it acts")
    silent = np.where(said.state_age_s > 0.0, said.state_age_s * 1e3, np.nan)
    if np.isfinite(silent).any():
        age.plot(times, silent, color=TROUBLE, lw=1.2, label="of the newest state")
        draw_limit(age, scene.limits.state_age_s * 1e3, "limit")
    ages = np.concatenate([said.loop_delay_s, said.state_age_s]) * 1e3
    age.set_ylim(0.0, 1.25 * max([1.0, *ages[np.isfinite(ages)].tolist()]))
    caption(age, "age of the state, ms")
    label_time(age, scene)
    return _figure(computing)


def _figure(axes: Axes) -> Figure:
    figure = axes.figure
    assert isinstance(figure, Figure)
    return figure
