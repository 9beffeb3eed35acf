"""What a report leaves for machines: Parquet tables, and one JSON object."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from companion.experiments.campaign_report.influence import Influence
from companion.experiments.campaign_report.report import Report
from companion.experiments.campaign_report.statistics import Distribution
from companion.experiments.campaign_report.tables import Case, Group
from companion.recording.whole_file import made_whole

GROUPS, WORST, LOST, SENSITIVITY = "groups", "worst", "lost", "sensitivity"
_CASE = ("point", "outcome", "note", "mean_error_m", "max_error_m", "flown_s", "scored_s")

Rows = Sequence[Mapping[str, Any]]


def write_tables(report: Report, folder: Path) -> list[Path]:
    """Write the tables, NAME.parquet each.

    `groups`, `worst`, `lost` (also what could not be flown) and `sensitivity`.  Lengths in metres;
    an infinite quantile is a lost flight's, an error of a lost flight NaN.

    Args:
        report: what is written.
        folder: where to; it is made.

    Raises:
        MissingExtraError: pyarrow is not installed.
        OSError: it can't be written.
    """
    names = [p.name for p in report.campaign.manifest.parameters]
    varying = [p.name for p in report.campaign.parameters]
    made = {
        GROUPS: [_group_row(group, varying) for group in report.groups],
        WORST: [_case_row(case, names) for case in report.worst],
        LOST: [_case_row(case, names) for case in (*report.lost, *report.unflown)],
        SENSITIVITY: [_influence_row(one) for one in report.sensitivity.influences],
    }
    folder.mkdir(parents=True, exist_ok=True)
    return [_write(folder / f"{name}.parquet", rows, _columns(name, names, varying))
            for name, rows in made.items()]  # fmt: skip


def report_object(report: Report, paths: Sequence[Path]) -> dict[str, Any]:
    """The report as JSON has it: null for what is not known or infinite."""
    campaign = report.campaign
    varying = [p.name for p in campaign.parameters]
    names = [p.name for p in campaign.manifest.parameters]
    said = {
        "campaign": campaign.manifest.name,
        "folder": str(campaign.folder),
        "engine": campaign.manifest.engine,
        "counts": {
            "planned": campaign.manifest.flights,
            "flown": len(campaign.flights),
            "lost": len(report.lost),
            "unflown": len(report.unflown),
        },
        "summary": asdict(report.summary),
        "remarks": report.remarks,
        GROUPS: [_group_row(group, varying) for group in report.groups],
        WORST: [_case_row(case, names) for case in report.worst],
        LOST: [_case_row(case, names) for case in (*report.lost, *report.unflown)],
        SENSITIVITY: [_influence_row(one) for one in report.sensitivity.influences],
        "files": [str(path) for path in paths],
    }
    plain: dict[str, Any] = _plain(said)
    return plain


def _group_row(group: Group, parameters: Sequence[str]) -> dict[str, Any]:
    given = dict(zip(group.by, group.values, strict=True))
    row: dict[str, Any] = {"by": " × ".join(group.by) or "all"}
    row |= {f"param.{name}": given[name] for name in parameters if name in given}
    row |= {
        "flights": group.flights,
        "outcomes": ", ".join(f"{name} {count}" for name, count in group.outcomes.items()),
        "lost": group.lost.count,
        "lost_share": group.lost.share,
        "lost_share_low": group.lost.low,
        "lost_share_high": group.lost.high,
    }
    return (
        row
        | _distribution("mean_error", group.mean_error)
        | _distribution("max_error", group.max_error)
    )


def _distribution(name: str, found: Distribution) -> dict[str, float]:
    figures = asdict(found)
    del figures["flights"]
    return {f"{name}_{figure}_m": value for figure, value in figures.items()}


def _case_row(case: Case, parameters: Sequence[str]) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(case, name) for name in _CASE}
    if case.lost:
        row |= {"mean_error_m": math.nan, "max_error_m": math.nan}
    row |= {f"param.{name}": case.values[name] for name in parameters}
    return row | {"command": case.command}


def _influence_row(one: Influence) -> dict[str, Any]:
    return {
        "group": one.group,
        "outcome": one.outcome,
        "parameter": one.parameter,
        "kind": one.kind,
        "levels": one.levels,
        "flights": one.flights,
        "first_order": one.share.value,
        "first_order_low": one.share.low,
        "first_order_high": one.share.high,
        "p": one.share.p,
        "p_adjusted": one.p_adjusted,
        "spearman": one.correlation.value,
        "spearman_low": one.correlation.low,
        "spearman_high": one.correlation.high,
        "best_level": one.best,
        "best_value": one.best_value,
        "worst_level": one.worst,
        "worst_value": one.worst_value,
    }


_TEXTS = {
    "by", "outcomes", "outcome", "note", "command", "group", "parameter", "kind", "best_level",
    "worst_level",
}  # fmt: skip
_COUNTS = {"flights", "lost", "point", "levels"}


def _columns(table: str, parameters: Sequence[str], varying: Sequence[str]) -> list[str]:
    """Names of a table's columns, the same whether it has rows or not."""
    errors = [
        f"{name}_{figure}_m"
        for name in ("mean_error", "max_error")
        for figure in ("mean", "median", "p90", "p99", "worst", "worst_tracked")
    ]
    if table == GROUPS:
        return ["by", *(f"param.{name}" for name in varying), "flights", "outcomes", "lost",
                "lost_share", "lost_share_low", "lost_share_high", *errors]  # fmt: skip
    if table == SENSITIVITY:
        return ["group", "outcome", "parameter", "kind", "levels", "flights", "first_order",
                "first_order_low", "first_order_high", "p", "p_adjusted", "spearman",
                "spearman_low", "spearman_high", "best_level", "best_value", "worst_level",
                "worst_value"]  # fmt: skip
    return [*_CASE, *(f"param.{name}" for name in parameters), "command"]


def _write(path: Path, rows: Rows, columns: Sequence[str]) -> Path:
    import pyarrow as arrow
    import pyarrow.parquet as parquet

    def kind(name: str) -> Any:  # noqa: ANN401 - pyarrow has no types
        given = [row[name] for row in rows if name in row]
        if name in _TEXTS or any(isinstance(value, str) for value in given):
            return arrow.string()
        return arrow.int64() if name in _COUNTS else arrow.float64()

    arrays = [arrow.array([row.get(name) for row in rows], type=kind(name)) for name in columns]
    table = arrow.Table.from_arrays(arrays, names=list(columns))
    made_whole(path, lambda unfinished: parquet.write_table(table, unfinished, compression="zstd"))
    return path


def _plain(value: Any) -> Any:  # noqa: ANN401 - JSON
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value
