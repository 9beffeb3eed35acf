"""`results.json`: every figure of the study that is a number, strict JSON.

Keys carry their units: `_m`, `_m_s` (m/s), `_s`, `_us` (µs), `_hz`; `_over_` is a ratio.  Errors
are mean distances |y2* - y2| between the desired and the true position.  null stands for what has
no finite value: the mean of flights of which one was lost, the spread of a single seed, a bound
whose conditions do not hold, a noise that nowhere decides.  What changes over time is not here but
in the flights' Parquet files.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from companion.experiments.paper.bounds import BoundsFlight
from companion.experiments.paper.changing_dynamics import HoverConvergence, LoadStep
from companion.experiments.paper.guarantees import Guarantees
from companion.experiments.paper.headline import MeanError, mean_errors, verdict_counts
from companion.experiments.paper.results import (
    Claim,
    PaperResults,
    ReferenceComparison,
    by_axis,
)
from companion.experiments.paper.scale import TRAJECTORIES, VEHICLE
from companion.experiments.paper.statistics import Spread
from companion.experiments.paper.tracking import Tracking
from companion.report.flight_data import Array

NAME = "results.json"
_ABOUT = (
    "Units are in the keys. Errors are mean distances between the desired and the true position. "
    "std_m is the sample's standard deviation over the seeds. null: no finite value (a lost "
    "flight, a single seed's spread, a bound whose conditions do not hold). Data over time are in "
    "flights/*.parquet."
)


def write_results(results: PaperResults, claims: Sequence[Claim], folder: Path) -> Path:
    """Write `results.json` into the study's folder.

    Raises:
        OSError: it can't be written.
    """
    path = folder / NAME
    text = json.dumps(
        results_object(results, claims), indent=2, ensure_ascii=False, allow_nan=False
    )
    path.write_text(text + "\n", encoding="utf-8")
    return path


def results_object(results: PaperResults, claims: Sequence[Claim]) -> dict[str, Any]:
    """The study as what JSON has: objects, arrays, strings, finite numbers, true, false, null."""
    times = results.computing_time
    content = {
        "about": _ABOUT,
        "provenance": asdict(results.provenance),
        "study": {
            "scale": results.scale.name,
            "seeds": list(results.scale.seeds),
            "vehicle": VEHICLE,
            "trajectories": list(TRAJECTORIES),
        },
        "verdicts": verdict_counts(claims),
        "mean_of_five": {one.controller: _headline(one) for one in mean_errors(results)},
        "claims": [asdict(claim) for claim in claims],
        "tracking": _tracking(results.tracking),
        "bounds": {
            name: _bounds(flight, results.guarantees) for name, flight in results.bounds.items()
        },
        "guarantees": _guarantees(results.guarantees),
        "adaptation_rate": _adaptation_rate(results),
        "reference_system": [_reference(one) for one in results.reference],
        "identification": [asdict(model) for model in results.identification],
        "model_transfer": _model_transfer(results),
        "load_step": {n: _load(step) for n, step in results.changing_dynamics.load.items()},
        "hover_convergence": _hover(results.changing_dynamics.hover),
        "origin": {
            cost: asdict(figures) | {"change": figures.change}
            for cost, figures in results.origin.items()
        },
        "computing_time": None if times is None else asdict(times),
    }
    plain: dict[str, Any] = _plain(content)
    return plain


def _headline(one: MeanError) -> dict[str, Any]:
    return {
        "calm_mean_m": one.calm.mean,
        "calm_std_m": one.calm.std,
        "fan_mean_m": one.fan.mean,
        "fan_std_m": one.fan.std,
        "calm_over_mpc_l1": one.calm_over_mpc_l1,
        "fan_over_mpc_l1": one.fan_over_mpc_l1,
        "fan_over_calm": one.fan_over_calm,
    }


def _spread(spread: Spread) -> dict[str, Any]:
    return {
        "mean_m": spread.mean,
        "std_m": spread.std,
        "seeds": spread.seeds,
        "lost": spread.lost,
        "values_m": list(spread.values),
    }


def _plain_spread(spread: Spread) -> dict[str, Any]:
    return {"mean": spread.mean, "std": spread.std, "seeds": spread.seeds}


def _tracking(tracking: Tracking) -> dict[str, Any]:
    return {
        "errors": {
            controller: {
                wind: {
                    "by_trajectory": {n: _spread(s) for n, s in errors.by_trajectory.items()},
                    "mean_of_five": _spread(errors.mean),
                    "tilt_slew_rms_g_s": _plain_spread(errors.tilt_slew_g_s),
                }
                for wind, errors in by_wind.items()
            }
            for controller, by_wind in tracking.errors.items()
        },
        "lag_s": {name: response.lag_s for name, response in tracking.responses.items()},
        "commanded_minus_flown_m": tracking.commanded_minus_flown_m,
    }


def _bounds(flight: BoundsFlight, guarantees: Guarantees) -> dict[str, Any]:
    return {
        "largest_y_tilde_m_s": by_axis(flight.largest_y_tilde_m_s),
        "largest_y_tilde_over_gamma_0": by_axis(
            _share(flight.largest_y_tilde_m_s, guarantees.gamma_0_m_s)
        ),
        "largest_distance_from_ideal_m": by_axis(flight.largest_distance_m),
        "mean_distance_from_ideal_m": flight.mean_distance_m,
        "flown_s": float(flight.times_s[-1]) if len(flight.times_s) else None,
    }


def _share(values: Array, bound: Array) -> Array:
    """Per axis; NaN where there is no bound."""
    share: Array = np.where(np.isfinite(bound), values / bound, np.nan)
    return share


def _guarantees(guarantees: Guarantees) -> dict[str, Any]:
    return {
        "norm_g": by_axis(guarantees.norm_g),
        "lipschitz": by_axis(guarantees.lipschitz),
        "gamma_0_m_s": by_axis(guarantees.gamma_0_m_s),
        "gamma_1_m_s": by_axis(guarantees.gamma_1_m_s),
        "noise_extra_m_s": by_axis(guarantees.noise_extra_m_s),
        "delta": by_axis(guarantees.delta),
        "delta_d_1_s": by_axis(guarantees.delta_d),
    }


def _adaptation_rate(results: PaperResults) -> dict[str, Any]:
    sweep = results.adaptation_rate
    return {
        "rates": [
            {
                "gamma_1_s2": gamma,
                "exact_largest_y_tilde_m_s": by_axis(exact),
                "noisy_largest_y_tilde_m_s": by_axis(noisy),
                "stable": stable,
                "fitted": fitted,
                "step_model_largest_y_tilde_m_s": step,
            }
            for gamma, exact, noisy, stable, fitted, step in zip(
                sweep.gammas,
                sweep.exact_m_s,
                sweep.noisy_m_s,
                sweep.stable,
                sweep.fitted,
                sweep.step_model_m_s,
                strict=True,
            )
        ],
        "slope": sweep.slope,
        "slope_all": sweep.slope_all,
        "step_model_slope": sweep.step_model_slope,
        "noise_decides_from_1_s2": sweep.noise_decides_from,
        "noise_floor_m_s": sweep.noise_floor_m_s,
        "well_sampled_to_1_s2": sweep.well_sampled_to,
    }


def _reference(comparison: ReferenceComparison) -> dict[str, Any]:
    return {
        "flight": comparison.name,
        "largest_m_s": by_axis(comparison.largest_m_s),
        "rms_m_s": by_axis(comparison.rms_m_s),
    }


def _model_transfer(results: PaperResults) -> dict[str, Any]:
    table = results.model_transfer
    return {
        "seeds": list(results.scale.seeds),
        "tuned_for": {
            row: {
                column: {"mean_m": table.errors_m[i, j], "seeds": len(results.scale.seeds)}
                for j, column in enumerate(TRAJECTORIES)
            }
            for i, row in enumerate(TRAJECTORIES)
        },
        "identified": {
            n: _spread(spread) for n, spread in zip(TRAJECTORIES, table.identified, strict=True)
        },
        "best_at_home": table.best_at_home,
        "own_over_identified": table.gain_at_home,
        "foreign_over_identified": table.loss_away,
        "foreign_worse_than_own_share": table.harmed_away,
    }


def _load(step: LoadStep) -> dict[str, Any]:
    return {
        "shortly_after": _spread(step.shortly_after),
        "settled": _spread(step.settled),
        "settled_without_load": _spread(step.settled_without),
        "from_ideal": _spread(step.from_ideal),
        "from_ideal_without_load": _spread(step.from_ideal_without),
        "largest_sag_m": step.largest_sag_m,
    }


def _hover(hover: HoverConvergence | None) -> dict[str, Any] | None:
    if hover is None:
        return None
    return {
        "expected_sine": hover.expected_sine,
        "settled_sine": hover.settled_sine,
        "settled_noisy_sine": hover.settled_noisy_sine,
        "settled_offset_m": hover.settled_offset_m,
        "settling_s": hover.settling_s,
        "largest_speed_m_s": hover.largest_speed_m_s,
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - any value that JSON can hold, or numpy's like
    """JSON's own types, with null for what is not finite and strings for keys."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [_plain(inner) for inner in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value
