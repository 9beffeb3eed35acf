"""A gust front met in hover, with the adaptation on and off."""

from pathlib import Path

import numpy as np

from companion.config.resolve import load_flight
from companion.control.thrust import GRAVITY_M_S2
from companion.report.flight_data import FlightData
from tools.docs.flights import fly
from tools.docs.style import FLOWN, OTHER, WARM, panels, save

_HOVER = "configs/trajectories/hover.yaml"
_EAST = 0
_BEGIN_S, _END_S = -2.0, 6.0
"""Of what is drawn, from the front on."""
_AIR_EAST = 0.8
"""Share of the front's push that is to the east: its wind is (4.8, 3.6, 0) of 6 m/s."""


def flights() -> tuple[FlightData, FlightData]:
    """The flight with the adaptation on, and the one with it off."""
    off = {"switch": "['t=0:l1-off']", "monitor.act": "false"}
    return fly(_HOVER, wind="gust-front")[1], fly(_HOVER, off, wind="gust-front")[1]


def blown_east_m(data: FlightData) -> tuple[np.ndarray, np.ndarray]:
    """Times since the front, s, and how far it truly is from where it hovered, m to the east."""
    time_s, east_m = _since_front(data, data.truth.time_s, data.truth.position_enu_m[:, _EAST])
    return time_s, east_m - np.mean(east_m[time_s < 0.0])


def draw(folder: Path) -> list[Path]:
    """Fly both and draw them; returns the picture's path."""
    on, off = flights()
    figure, (error, answer, estimate) = panels(3, 1, (7.6, 6.4), sharex=True)
    for data, colour, name in (
        (off, OTHER, "adaptation held at its mean before"),
        (on, FLOWN, "L1 adapts"),
    ):
        time_s, east_m = blown_east_m(data)
        error.plot(time_s, 1e3 * east_m, color=colour, label=name)
    error.set_title("Where it is, east of where it hovered")
    error.set_ylabel("mm")
    error.set_ylim(-80.0, 560.0)
    error.legend(loc="upper left", ncols=2)

    wind_s, push = _since_front(on, on.truth.wind_time_s, on.truth.wind_acceleration_m_s2)
    answer.plot(wind_s, _AIR_EAST * push, color=WARM, label="what the air pushes")
    time_s, u = _since_front(on, on.ticks.time_s, on.ticks.applied_u[:, _EAST])
    lean = -GRAVITY_M_S2 * (u - np.mean(u[time_s < 0.0]))
    answer.plot(time_s, lean, color=FLOWN, label="what the tilt pushes against it, −g u")
    answer.set_title("The push of the air, and the answer to it")
    answer.set_ylabel("m/s²")
    answer.set_ylim(-2.2, 4.6)
    answer.legend(loc="upper left", ncols=2)

    time_s, sigma = _since_front(on, *_sigma(on))
    estimate.plot(time_s, sigma, color=WARM, lw=2.4, label="σ, from the truth")
    time_s, believed = _since_front(on, on.ticks.time_s, on.ticks.sigma_hat[:, _EAST])
    estimate.plot(
        time_s, believed, color=FLOWN, lw=1.0, label="σ̂, which knows measured velocities only"
    )
    estimate.set_title("All by which the vehicle differs from M(s), and its estimate")
    estimate.set_ylabel("unit of u")
    estimate.set_ylim(-6.0, 8.0)
    estimate.legend(loc="upper left", ncols=2)
    estimate.set_xlabel("seconds since the front arrives")
    estimate.set_xlim(_BEGIN_S, _END_S)
    says = "A gust front in hover: with L1 the vehicle comes back, without it is blown off."
    return [save(figure, folder / "how-l1.svg", says)]


def _since_front(
    data: FlightData, time_s: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What is drawn of a series, its time counted from the front."""
    [front] = [event for event in data.truth.events if event.time_s > 0.0][:1]
    since = time_s - front.time_s
    seen = (since >= _BEGIN_S) & (since <= _END_S)
    return since[seen], values[seen]


def _sigma(data: FlightData) -> tuple[np.ndarray, np.ndarray]:
    """Times, and σ = y1 + y1'/m - u to the east, from the true velocity and the applied u."""
    [m, *_] = load_flight(None, {"controller": "mpc-l1", "vehicle": "bebop2"}, {}).controller.l1.m
    time_s, y1 = data.truth.time_s, data.truth.velocity_enu_m_s[:, _EAST]
    u = np.interp(time_s, data.ticks.time_s, data.ticks.applied_u[:, _EAST])
    return time_s, y1 + np.gradient(y1, time_s) / m - u
