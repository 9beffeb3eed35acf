"""Comparisons whose figures are made up, for tests of what tells of them."""

import math

from companion.report.compare_results import Comparison, Flown, Perturbed, make_cell

NOMINAL = Perturbed("nominal", "the vehicle as it is", 1.0)
LAG = Perturbed("lag+25", "attitude lag + 25 %", 2.0)
MUCH_LAG = Perturbed("lag+50", "attitude lag + 50 %", 4.0)

ERRORS_MM = {
    ("mpc-l1", "calm"): (20.0, 30.0, math.inf),
    ("mpc-l1", "fan"): (32.0, 45.0, math.inf),
    ("mpc-l1-plus", "calm"): (5.0, 6.0, 30.0),
    ("mpc-l1-plus", "fan"): (9.0, 10.0, 35.0),
}
"""By controller and wind, under the three perturbations."""


def flown(trajectory, seed, error_mm, note="The geofence was left."):
    lost = not math.isfinite(error_mm)
    return Flown(
        str(trajectory),
        seed,
        "aborted" if lost else "tracked",
        note if lost else "",
        error_mm * 1e-3,
        math.nan if lost else 0.3,
        math.nan if lost else 0.01 * seed,
    )


def comparison(errors_mm=ERRORS_MM, perturbations=(NOMINAL, LAG, MUCH_LAG), **changes):
    """Two trajectories and two seeds; an error that is not finite loses one flight of the four."""
    controllers = tuple(dict.fromkeys(controller for controller, _ in errors_mm))
    winds = tuple(dict.fromkeys(wind for _, wind in errors_mm))
    cells = []
    for (controller, wind), by_perturbation in errors_mm.items():
        for p, error in zip(perturbations, by_perturbation, strict=False):
            known = error if math.isfinite(error) else 100.0
            flights = [
                flown(4, 1, 0.9 * known),
                flown(4, 2, 1.0 * known),
                flown(5, 1, 1.0 * known),
                flown(5, 2, 1.1 * known if math.isfinite(error) else error),
            ]
            cells.append(make_cell(controller, wind, p.name, flights))
    fields = {
        "vehicle": "bebop2",
        "autopilot": "px4",
        "setpoint": "attitude",
        "sensors": None,
        "against": "truth",
        "whole": False,
        "controllers": controllers,
        "winds": winds,
        "perturbations": tuple(perturbations),
        "trajectories": ("4", "5"),
        "seeds": (1, 2),
        "cells": tuple(cells),
        "command": "companion compare",
        "version": "0.1.0",
        "commit": "",
    }
    return Comparison(**(fields | changes))
