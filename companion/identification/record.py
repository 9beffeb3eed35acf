"""An identification as one object: the figures of `identify.json`."""

from dataclasses import fields
from typing import Any

import numpy as np

from companion.identification.estimates import Estimate, Identified, NoiseEstimates, Response
from companion.identification.recommend import Recommendation


def identification_record(
    identified: Identified, recommendation: Recommendation | None
) -> dict[str, Any]:
    """What was found, each figure as value, half width of its 95 % interval, and unit.

    Args:
        identified: what was found.
        recommendation: what was derived from it; None where no gains hold.
    """
    record: dict[str, Any] = {}
    for field in fields(identified):
        value = getattr(identified, field.name)
        if field.name == "curves":
            record["residual_rms"] = {
                curve.name: float(np.sqrt(np.nanmean((curve.measured - curve.fitted) ** 2)))
                for curve in identified.curves
            }
        elif field.name == "noise_estimates":
            record["noise"] = _noise(value)
        else:
            record[field.name] = _found(value)
    if recommendation is not None:
        record["mpc_l1"] = {
            "gains": recommendation.controller.model_dump(mode="json", exclude_none=True),
            "predicted_error_mm": {
                "xy": dict(recommendation.horizontal.errors_mm),
                "z": dict(recommendation.vertical.errors_mm),
                "z_climb_rate": dict(recommendation.climb_rate.errors_mm),
            },
        }
    return record


def _found(value: Estimate | Response | None) -> dict[str, Any] | None:
    if value is None:
        return None
    if isinstance(value, Estimate):
        ends = {} if value.ends_95 is None else {"ends_95": list(value.ends_95)}
        return {
            "value": value.value,
            "half_width_95": value.half_width_95,
            "unit": value.unit,
            **ends,
        }
    return {field.name: _found(getattr(value, field.name)) for field in fields(value)}


def _noise(noise: NoiseEstimates) -> dict[str, Any]:
    return {
        "position_m": [_found(axis) for axis in noise.position_m],
        "velocity_m_s": [_found(axis) for axis in noise.velocity_m_s],
        "acceleration_m_s2_sqrt_hz": [_found(axis) for axis in noise.acceleration_m_s2_sqrt_hz],
        "tilt_rad": _found(noise.tilt_rad),
    }
