"""What a campaign's folder says of itself: `campaign.json`."""

import json
import math
import os
import platform
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from companion.config.yaml_source import ConfigError
from companion.experiments.campaigns.plan import Parameter, Plan
from companion.experiments.flight_task import code_digest
from companion.experiments.provenance import commit, version
from companion.recording.whole_file import write_whole

MANIFEST = "campaign.json"


@dataclass(frozen=True, slots=True)
class Manifest:
    """Of a campaign that was begun."""

    name: str
    engine: str
    flights: int
    """How many there are in the plan."""
    plan: str
    """Digest of what is flown."""
    parameters: tuple[Parameter, ...]
    said: dict[str, Any]
    """All that stands there."""


def write_manifest(folder: Path, plan: Plan, command: str) -> None:
    """Say what is flown in a folder, by which program, where.

    Raises:
        OSError: it can't be written.
    """
    config = plan.config
    said = {
        "name": config.name,
        "says": config.says,
        "file": str(plan.path),
        "path": str(plan.path.absolute()),
        "yaml": plan.text,
        "command": command,
        "version": version(),
        "commit": commit(),
        "code": code_digest(),
        "date": datetime.now(UTC).date().isoformat(),
        "machine": machine(),
        "engine": config.engine,
        "keep": config.keep,
        "base": config.base.model_dump(mode="json"),
        "sampling": config.sample.model_dump(mode="json"),
        "flights": len(plan.flights),
        "rows_per_point": math.prod(map(len, config.each.values())) * (config.seeds or 1),
        "plan": plan.digest,
        "parameters": [_lean(asdict(parameter)) for parameter in plan.parameters],
    }
    text = json.dumps(said, indent=2, ensure_ascii=False, allow_nan=False)
    write_whole(folder / MANIFEST, text + "\n")


def read_manifest(folder: Path) -> Manifest | None:
    """What a folder says; None if no campaign was begun in it.

    Raises:
        ConfigError: it says something that no campaign does.
        OSError: it can't be read.
    """
    path = folder / MANIFEST
    try:
        said = json.loads(path.read_text(encoding="utf-8"))
        parameters = tuple(
            Parameter(**(p | ({"values": tuple(p["values"])} if "values" in p else {})))
            for p in said["parameters"]
        )
        return Manifest(
            said["name"], said["engine"], said["flights"], said["plan"], parameters, said
        )
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"{path}: not what a campaign writes ({error!r}). Give another folder with --out."
        ) from error


def machine() -> dict[str, Any]:
    """What a campaign is flown on."""
    return {
        "system": f"{platform.system()} {platform.machine()}",
        "processors": os.cpu_count(),
        "python": platform.python_version(),
        "libraries": libraries(),
    }


def libraries() -> dict[str, str]:
    """Versions of the libraries that may decide a figure's last digits."""
    found = {}
    for name in ("numpy", "numba", "osqp", "daqp"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def _lean(said: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in said.items() if value is not None}
