"""What a campaign's file can't ask for, told with line and remedy before anything is flown."""

from companion.config.yaml_source import ConfigError, Source
from companion.experiments.campaigns.models import MOST_FLIGHTS, CampaignConfig
from companion.experiments.campaigns.parameters import (
    LABELS,
    PLANT,
    fault_of_name,
    fault_of_value,
)


def check_campaign(config: CampaignConfig, source: Source) -> None:
    """Refuse names that nothing is done with, values that they don't take, grids without steps.

    Raises:
        ConfigError: with file, line and remedy.
    """
    _check_names(config, source)
    _check_sample(config, source)
    _check_values(config, source)


def at(source: Source, *path: str) -> str:
    """The file and the line of a key, or of what it would stand in."""
    for k in range(len(path), 0, -1):
        if path[:k] in source.lines:
            return f"{source.name}, line {source.lines[path[:k]]}"
    return source.name


def _check_names(config: CampaignConfig, source: Source) -> None:
    """Refuse names that nothing is done with, and ones given twice.

    Raises:
        ConfigError: with line and remedy.
    """
    for section, names in (("parameters", config.parameters), ("each", config.each)):
        for name in names:
            fault = fault_of_name(name)
            if fault is not None:
                raise ConfigError(f"{at(source, section, name)}: {fault}")
    for name in config.each:
        if name in config.parameters:
            raise ConfigError(
                f"{at(source, 'each', name)}: '{name}' varies by `parameters` already. Leave one "
                "of the two out."
            )
    if config.seeds is not None:
        for section, names in (("parameters", config.parameters), ("each", config.each)):
            if "seed" in names:
                raise ConfigError(
                    f"{at(source, 'seeds')}: 'seed' varies by `{section}` already. Leave one of "
                    "the two out."
                )
    for name in config.base.settings:
        fault = fault_of_name(name)
        if fault is not None or name in PLANT:
            raise ConfigError(
                f"{at(source, 'base', 'settings', name)}: "
                f"{fault or f'{name} is a parameter; put it there.'}"
            )


def _check_sample(config: CampaignConfig, source: Source) -> None:
    total = 1
    for name, given in config.parameters.items():
        where = at(source, "parameters", name)
        if config.sample.method != "grid":
            if given.steps is not None:
                raise ConfigError(
                    f"{where}: steps belong to a grid; a {config.sample.method} sample spreads its "
                    "points by itself. Remove steps."
                )
            continue
        if given.values is None and given.steps is None:
            raise ConfigError(f"{where}: a grid needs to know how many steps. Add steps.")
        total *= len(given.values) if given.values is not None else given.steps or 1
    if total > MOST_FLIGHTS:
        raise ConfigError(
            f"{source.name}: the grid has {total} points, and {MOST_FLIGHTS} are the most. Give "
            "fewer values, or take a latin-hypercube sample."
        )


def _check_values(config: CampaignConfig, source: Source) -> None:
    """Refuse values that their names don't take."""
    for name, given in config.parameters.items():
        where = at(source, "parameters", name)
        values = given.values if given.values is not None else (given.low, given.high)
        if name in LABELS and given.values is None:
            raise ConfigError(f"{where}: '{name}' needs a list of choices, not a range.")
        if name == "seed" and given.values is None:
            if not given.integer:
                raise ConfigError(f"{where}: seeds are whole numbers. Add integer: true.")
            values = tuple(int(end) for end in (given.low, given.high) if end is not None)
        for value in values:
            fault = fault_of_value(name, value)
            if fault is not None:
                raise ConfigError(f"{where}: {fault}.")
    for name, choices in config.each.items():
        for value in choices:
            fault = fault_of_value(name, value)
            if fault is not None:
                raise ConfigError(f"{at(source, 'each', name)}: {fault}.")
