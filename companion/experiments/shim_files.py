"""The simulator's files, found without its being imported: they are data here, its code is not."""

import importlib.util
from pathlib import Path

from companion.config.yaml_source import ConfigError, read_yaml

_YAML = (".yaml", ".yml")


def shim_folder() -> Path:
    """Folder of the shim's package."""
    spec = importlib.util.find_spec("sitl_shim")
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin).parent


def check_sensors(name_or_path: str) -> None:
    """See that there is such a sensor profile; what it says is the shim's to judge.

    Args:
        name_or_path: what has a separator or ends in ``.yaml`` is a path, as for the shim.

    Raises:
        ConfigError: there is none, or it is not YAML.
    """
    path = Path(name_or_path)
    if path.suffix in _YAML or path.name != name_or_path:
        if not path.is_file():
            raise ConfigError(f"sensors: {name_or_path}: no such sensor profile. Check the path.")
        read_yaml(path)
        return
    known = sorted(file.stem for file in (shim_folder() / "sensors" / "profiles").glob("*.yaml"))
    if name_or_path not in known:
        raise ConfigError(
            f"sensors: there is no sensor profile '{name_or_path}'. Give one of "
            f"{', '.join(known)}, or a YAML file."
        )
