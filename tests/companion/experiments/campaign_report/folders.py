"""Campaign folders, made up: rows by a law that is known, written as a campaign writes them."""

import json
import math

import numpy as np

from companion.experiments.campaigns.plan import Parameter
from companion.experiments.campaigns.results import write_results

MASS = Parameter("plant.mass", "number", low=0.8, high=1.2, nominal=1.0)
DELAY = Parameter("plant.delay_s", "number", "s", low=0.0, high=0.05, nominal=0.0)
DRAG = Parameter("plant.drag", "number", low=0.5, high=2.0, nominal=1.0)
CONTROLLER = Parameter("controller", "choice", values=("mpc-l1", "pid-l1"), nominal="mpc-l1")
WIND = Parameter("wind", "choice", values=("calm", "fan"), nominal="calm")
TRAJECTORY = Parameter("trajectory", "choice", values=("2", "4"), nominal="4")
PARAMETERS = (MASS, DELAY, DRAG, WIND, TRAJECTORY, CONTROLLER)


def rows(points=80, seed=1, parameters=PARAMETERS):
    """Flights whose error grows with delay, then with mass off its nominal; some delays lose."""
    drawn = np.random.default_rng(seed)
    found = []
    for _ in range(points):
        mass, delay, drag = drawn.uniform([0.8, 0.0, 0.5], [1.2, 0.05, 2.0]).tolist()
        wind, trajectory = drawn.choice(["calm", "fan"]), drawn.choice(["2", "4"])
        for k, controller in enumerate(CONTROLLER.values):
            error = 0.008 + 0.4 * delay + 0.02 * abs(mass - 1.0) + 0.03 * k
            error *= float(np.exp(0.05 * drawn.normal())) * (1.3 if wind == "fan" else 1.0)
            lost = k == 1 and delay > 0.04
            values = {
                "plant.mass": mass,
                "plant.delay_s": delay,
                "plant.drag": drag,
                "wind": str(wind),
                "trajectory": str(trajectory),
                "controller": controller,
            }
            found.append(row(len(found), values, error, lost=lost, parameters=parameters))
    return found


def row(point, values, error_m, *, lost=False, outcome=None, note="", parameters=PARAMETERS):
    """One flight."""
    error = math.nan if lost else error_m
    told = note or ("the tilt was beyond 45.0° for 0.31 s" if lost else "")
    return {
        "point": point,
        "key": f"flight-{point}",
        "engine": "flights",
        **{f"param.{p.name}": values[p.name] for p in parameters},
        "outcome": outcome or ("aborted" if lost else "tracked"),
        "note": told,
        "mean_error_m": error,
        "rms_error_m": 1.1 * error,
        "max_error_m": 2.5 * error,
        "reported_mean_error_m": error,
        "flown_s": 3.0 + point * 0.01 if lost else 20.0,
        "scored_s": 20.0,
        "fallbacks": 0,
        "r_max_share": 0.0,
        "wind_peak_m_s2": 0.0,
        "tilt_slew_rms_g_s": 0.4,
        "wall_s": 1.0,
    }


def manifest(planned, parameters=PARAMETERS, **changes):
    """What `campaign.json` says."""
    return {
        "name": "robust",
        "says": "How far from nominal may a vehicle be?",
        "file": "configs/campaigns/robust.yaml",
        "yaml": "name: robust\neach: {controller: [mpc-l1, pid-l1]}\n",
        "command": "companion campaign configs/campaigns/robust.yaml",
        "version": "0.1.0",
        "commit": "0123abcd",
        "date": "2026-01-02",
        "machine": {"system": "Linux x86_64", "processors": 2, "libraries": {"numpy": "2.0"}},
        "engine": "flights",
        "base": {"controller": "mpc-l1"},
        "sampling": {"method": "latin-hypercube", "points": 80, "seed": 1},
        "flights": planned,
        "plan": "0123456789ab",
        "parameters": [
            {k: v for k, v in (("name", p.name), ("kind", p.kind), ("unit", p.unit),
             ("low", p.low), ("high", p.high), ("values", p.values), ("nominal", p.nominal))
             if v is not None}
            for p in parameters
        ],
    } | changes  # fmt: skip


def write_campaign(folder, rows, planned=None, parameters=PARAMETERS, **changes):
    """A campaign's folder; the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    said = manifest(len(rows) if planned is None else planned, parameters, **changes)
    (folder / "campaign.json").write_text(json.dumps(said), encoding="utf-8")
    write_results(folder, rows, parameters)
    return folder
