"""Plant files of the shim's vehicles, changed: what a controller must bear."""

import importlib.util
from pathlib import Path
from typing import Any

import yaml

from companion.config.yaml_source import ConfigError

_GAINS = ("MC_ROLL_P", "MC_PITCH_P")


def with_attitude_lag(vehicle: str, factor: float, folder: Path) -> Path:
    """Write a plant file of a shipped vehicle whose attitude lags more by a factor.

    The lag is inverse to the gain of the autopilot's attitude loop.

    Args:
        vehicle: its name.
        factor: on the lag.
        folder: of the new file.

    Raises:
        ConfigError: the shim has no such vehicle, or its file no such gain.
        OSError: the file can't be written.
    """
    plant = _read(vehicle)
    parameters = plant.get("autopilot_parameters", {})
    for name in _GAINS:
        if name not in parameters:
            raise ConfigError(f"the shim's plant of {vehicle} states no {name}. Add it.")
        parameters[name] = parameters[name] / factor
    path = folder / f"{vehicle}-attitude-lag-{factor:g}.yaml"
    path.write_text(yaml.safe_dump(plant, sort_keys=False), encoding="utf-8")
    return path


def _read(vehicle: str) -> dict[str, Any]:
    # Found without being imported: the shim's files are data here, its code is none of ours.
    spec = importlib.util.find_spec("sitl_shim")
    assert spec is not None
    assert spec.origin is not None
    path = Path(spec.origin).parent / "plant" / "vehicles" / f"{vehicle}.yaml"
    try:
        plant: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"the shim has no vehicle {vehicle}.") from error
    return plant
