"""From a campaign's file to its flights."""

import hashlib
import itertools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from companion.config.resolve import find_config
from companion.config.validation import validate
from companion.config.yaml_source import ConfigError, parse_yaml, read_yaml
from companion.experiments.campaigns.checks import at, check_campaign
from companion.experiments.campaigns.models import MOST_FLIGHTS, BaseConfig, CampaignConfig, Value
from companion.experiments.campaigns.parameters import LABELS, NAMED, PLANT, label, nominal
from companion.experiments.campaigns.sampling import Axis, Point, remark, sample

_FILES = (".yaml", ".yml", ".csv")
_DIGEST_LETTERS = 12


@dataclass(frozen=True, slots=True)
class Parameter:
    """What varies, as the report has it."""

    name: str
    kind: Literal["number", "choice"]
    unit: str | None = None
    low: float | None = None
    high: float | None = None
    values: tuple[str | float, ...] | None = None
    nominal: str | float | None = None

    def cell(self, value: Value) -> str | float:
        """A point's value in the table of results."""
        if self.kind == "choice":
            return label(value)
        assert isinstance(value, int | float)
        return float(value)


@dataclass(frozen=True, slots=True)
class PlannedFlight:
    """One flight: a point of the plan."""

    point: int
    values: Mapping[str, Value]
    """By parameter."""


@dataclass(frozen=True, slots=True)
class Plan:
    """All that a campaign flies."""

    config: CampaignConfig
    text: str
    """The file's."""
    path: Path
    parameters: tuple[Parameter, ...]
    flights: tuple[PlannedFlight, ...]
    digest: str
    """Of what is flown: the same for the same flights, however the file is written."""
    remarks: tuple[str, ...] = ()
    """What a person should know before it is flown."""


def load_plan(name_or_path: str) -> Plan:
    """Read a campaign's file: a shipped one by its name, or by its path.

    Paths in it are relative to its folder.

    Raises:
        ConfigError: it can't be used; the text names file, line, key and remedy.
    """
    path = find_config("campaign", name_or_path)
    read_yaml(path)  # says why it can't be read, if so
    return plan_of(path.read_text(encoding="utf-8"), path)


def plan_of(text: str, path: Path) -> Plan:
    """The plan of a campaign's text.

    Args:
        text: YAML.
        path: where it stands or stood: what it names is relative to the path's folder.

    Raises:
        ConfigError: as `load_plan`.
    """
    source = parse_yaml(text, str(path))
    config = validate(CampaignConfig, source)
    check_campaign(config, source)
    crossed = dict(config.each)
    if config.seeds is not None:
        crossed["seed"] = tuple(range(1, config.seeds + 1))
    names = (*config.parameters, *crossed)
    points = sample(config.sample, [Axis.of(given) for given in config.parameters.values()])
    every = list(itertools.product(*crossed.values()))
    if len(points) * len(every) > MOST_FLIGHTS:
        raise ConfigError(
            f"{path}: {len(points)} points, {len(every)} times each, are more than {MOST_FLIGHTS} "
            "flights. Take fewer points."
        )
    values = [(*point, *more) for point, more in itertools.product(points, every)]
    said = remark(config.sample)
    found = _relative_to(path.parent)
    digest = _digest(config, names, values)
    config = config.model_copy(update={"base": _base(config.base, found)})
    return Plan(
        config,
        text,
        path,
        _parameters(config, crossed, found),
        tuple(
            PlannedFlight(
                index,
                {n: found(v) if n in NAMED else v for n, v in zip(names, row, strict=True)},
            )
            for index, row in enumerate(values)
        ),
        digest,
        () if said is None else (f"{at(source, 'sample', 'points')}: {said}",),
    )


def _digest(config: CampaignConfig, names: Sequence[str], values: Sequence[Point]) -> str:
    said = [config.engine, config.base.model_dump(mode="json"), names, values]
    text = json.dumps(said, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGEST_LETTERS]


def _relative_to(folder: Path) -> Callable[[Any], Any]:
    """Makes names of files relative to where one is, not to the campaign's folder."""

    def found(value: Any) -> Any:  # noqa: ANN401 - any value of YAML
        is_file = isinstance(value, str) and value.endswith(_FILES)
        return os.path.normpath(folder / value) if is_file else value

    return found


def _base(base: BaseConfig, found: Callable[[Any], Any]) -> BaseConfig:
    return base.model_copy(update={name: found(getattr(base, name)) for name in NAMED})


def _parameters(
    config: CampaignConfig, crossed: Mapping[str, tuple[Value, ...]], found: Callable[[Any], Any]
) -> tuple[Parameter, ...]:
    base = config.base
    told = []
    for name, given in config.parameters.items():
        unit = given.unit or (PLANT[name].unit if name in PLANT else None)
        if given.values is not None:
            told.append(_of_choices(name, given.values, unit, base, found))
            continue
        stated = _number(nominal(name, base))
        told.append(Parameter(name, "number", unit, given.low, given.high, None, stated))
    return (*told, *(_of_choices(name, v, None, base, found) for name, v in crossed.items()))


def _of_choices(
    name: str,
    values: tuple[Value, ...],
    unit: str | None,
    base: BaseConfig,
    found: Callable[[Any], Any],
) -> Parameter:
    stated = nominal(name, base)
    numbers = tuple(n for n in map(_number, values) if n is not None)
    if name not in LABELS and len(numbers) == len(values):
        return Parameter(name, "number", unit, min(numbers), max(numbers), numbers, _number(stated))
    told = tuple(label(found(value) if name in NAMED else value) for value in values)
    is_known = stated is not None or name == "faults"
    return Parameter(name, "choice", unit, values=told, nominal=label(stated) if is_known else None)


def _number(value: Value) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
