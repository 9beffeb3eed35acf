"""The rows of the table of faults: data, in `configs/fault-table.yaml`."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from companion.config.base import NonNegative, Positive, Section
from companion.config.resolve import configs_folder
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, Source, read_yaml

Flavour = Literal["px4", "ardupilot"]
FLAVOURS: tuple[Flavour, ...] = ("px4", "ardupilot")

Ending = Literal["landed", "held", "handed over", "crashed"]
"""What a row may promise of how it ends:

- `landed`: by the companion, the mission flown to its end or cut short.
- `held`: the autopilot holds the vehicle in the air.
- `handed over`: the autopilot has landed it, or is bringing it down.
- `crashed`: where no software could help.
"""

_SHIPPED = "fault-table.yaml"
_PATHS = ("trajectory", "vehicle", "controller", "wind")
_YAML = (".yaml", ".yml", ".csv")


class Promise(Section):
    """What a row promises, besides what all flights promise (see `judging`)."""

    endings: Annotated[tuple[Ending, ...], Field(strict=False, min_length=1)]
    """One of these."""
    completed: bool | None = None
    """Whether the trajectory is flown to its end; None: either."""
    begins: str | None = None
    """Event of the simulation's truth at which the fault begins; None: it is there from boot on."""
    within_s: Positive | None = None
    """What `says` names is said this soon after the fault begins; where nothing is named, any
    warning, error or hand-over."""
    says: str | None = None
    """Part of a text that the user sees after the fault begins."""
    handed_over_within_s: Positive | None = None
    """The vehicle is handed over this soon after it begins."""
    mean_error_mm: Positive | None = None
    """The mean tracking error, against the truth, is no larger."""
    worst_error_mm: Positive | None = None
    """Nor is the largest."""
    autopilot_says: str | None = None
    """Part of a text of the autopilot's that the user sees."""

    @model_validator(mode="after")
    def _a_beginning(self) -> "Promise":
        if self.within_s is not None and self.begins is None:
            raise ValueError("within_s needs the event that the time counts from. Give 'begins'")
        if self.handed_over_within_s is not None and self.begins is None:
            raise ValueError(
                "handed_over_within_s needs the event that the time counts from. Give 'begins'"
            )
        return self


class Row(Section):
    """One kind of fault."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$")]
    group: Literal["link", "vehicle", "process"]
    what: str
    """The fault, in one sentence."""
    kind: Literal["flight", "process"] = "flight"
    """`process`: not flown by `companion faults`, but by ``pytest -m faults``."""
    faults: str | dict[str, Any] | None = None
    """As in a mission: a name, a file, or the faults themselves."""
    autopilots: Annotated[tuple[Flavour, ...], Field(strict=False, min_length=1)] = FLAVOURS
    mission: dict[str, Any] = Field(default_factory=dict)
    """Keys of the mission that differ from the table's; dotted keys are set alone."""
    promise: Promise | None = None
    differs: dict[Flavour, dict[str, Any]] = Field(default_factory=dict)
    """Keys of the promise that are other ones under one autopilot."""
    detected: str
    """What the companion sees of it, for the table in docs/safety.md."""
    done: str
    seen: str
    """What the user sees."""
    after: str | None = None
    """When it is detected, of a row that is not flown here, and whose time is not measured."""
    test: str | None = None
    """The test that shows it, as ``FILE::NAME``; None: `companion faults` alone does."""

    @model_validator(mode="after")
    def _whole(self) -> "Row":
        if (self.kind == "flight") != (self.promise is not None):
            raise ValueError("a row that is flown has a promise, and one of a process has none")
        if self.kind == "flight" and self.faults is None:
            raise ValueError("a row that is flown has faults. Give 'faults'")
        for autopilot in self.differs:
            try:
                self.promised(autopilot)
            except ValidationError as error:
                first = error.errors()[0]
                key = ".".join(str(part) for part in ("differs", autopilot, *first["loc"]))
                raise ValueError(f"{key}: {first['msg']}") from error
        return self

    @property
    def shown_by(self) -> str:
        """What shows it, for a reader: a test, or a command."""
        return self.test or f"companion faults --only {self.name}"

    def promised(self, autopilot: Flavour) -> Promise:
        """What it promises under an autopilot.

        Raises:
            ValueError: the row is of a process.
        """
        if self.promise is None:
            raise ValueError(f"{self.name} is not flown")
        known = self.promise.model_dump()
        return Promise.model_validate({**known, **self.differs.get(autopilot, {})})


class FaultTable(Section):
    """All rows, and what their flights have in common."""

    mission: dict[str, Any] = Field(default_factory=dict)
    rows: Annotated[tuple[Row, ...], Field(strict=False, min_length=1)]
    aftermath_s: NonNegative = 40.0
    """So long a vehicle is watched at most after the companion's flight has ended."""

    @model_validator(mode="after")
    def _each_once(self) -> "FaultTable":
        names = [row.name for row in self.rows]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"the row '{twice[0]}' stands there twice. Rename one")
        return self


def load_table(path: Path | None = None) -> FaultTable:
    """Read a table; paths in it are relative to its folder.

    Args:
        path: of the YAML file; None for the shipped one.

    Raises:
        ConfigError: with file, line, key and remedy.
    """
    path = path or configs_folder() / _SHIPPED
    source = read_yaml(path)
    data = dict(source.data)
    data["mission"] = _with_paths(data.get("mission"), path.parent)
    if isinstance(data.get("rows"), list):
        data["rows"] = [_row_with_paths(row, path.parent) for row in data["rows"]]
    return validate(FaultTable, Source(source.name, data, source.lines))


def chosen_rows(table: FaultTable, names: tuple[str, ...]) -> tuple[Row, ...]:
    """The rows of these names, or all.

    Args:
        table: with the rows.
        names: a part of a row's name will do.

    Raises:
        ConfigError: there is none of a name.
    """
    if not names:
        return table.rows
    for name in names:
        if not any(name in row.name for row in table.rows):
            known = ", ".join(row.name for row in table.rows)
            raise ConfigError(f"--only {name}: there is no such row. There are {known}.")
    exact = {row.name for row in table.rows}.intersection(names)
    return tuple(
        row
        for row in table.rows
        if row.name in exact or any(name in row.name for name in names if name not in exact)
    )


def _row_with_paths(row: object, folder: Path) -> object:
    if not isinstance(row, dict):
        return row
    mended = dict(row)
    if "mission" in mended:
        mended["mission"] = _with_paths(mended["mission"], folder)
    faults = mended.get("faults")
    if isinstance(faults, str) and faults.endswith(_YAML):
        mended["faults"] = str(folder / faults)
    return mended


def _with_paths(mission: object, folder: Path) -> object:
    if mission is None:
        return {}
    if not isinstance(mission, dict):
        return mission
    return {
        key: str(folder / value)
        if key in _PATHS and isinstance(value, str) and value.endswith(_YAML)
        else value
        for key, value in mission.items()
    }
