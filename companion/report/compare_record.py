"""A comparison as JSON: `compare.json`, and what ``--json`` prints."""

import math
from dataclasses import asdict
from typing import Any

from companion.report.compare_results import Cell, Comparison


def comparison_object(comparison: Comparison) -> dict[str, Any]:
    """All of it with plain types; lengths in metres; null where there is no figure."""
    plain = asdict(comparison)
    plain["cells"] = [_cell_object(comparison, cell) for cell in comparison.cells]
    return {key: _plain(value) for key, value in plain.items()}


def _cell_object(comparison: Comparison, cell: Cell) -> dict[str, Any]:
    return asdict(cell) | {
        "lost": cell.lost,
        "ratio_to_first": comparison.to_first(cell),
        "ratio_to_nominal": comparison.to_nominal(cell),
        "bears": comparison.bears(cell),
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 - any JSON value
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
