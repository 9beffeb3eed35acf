"""What ``companion schema`` does: show the JSON Schema of a kind of YAML file."""

import sys
from dataclasses import dataclass

from companion.config.folders import configs_folder, schema_path
from companion.config.yaml_source import ConfigError


@dataclass(frozen=True, slots=True)
class SchemaRequest:
    """The options of the command line."""

    kind: str | None = None
    """None: list the kinds."""
    path_only: bool = False
    """The path of the file in place of what it holds."""


def kinds() -> tuple[str, ...]:
    """Kinds of YAML files that there is a schema of, sorted."""
    return tuple(sorted(path.stem for path in (configs_folder() / "schemas").glob("*.json")))


def run_schema(request: SchemaRequest) -> None:
    """Show what was asked for.

    Raises:
        ConfigError: there is no such kind.
    """
    known = kinds()
    if request.kind is None:
        for kind in known:
            sys.stdout.write(f"{kind:<12} {schema_path(kind)}\n")
        return
    if request.kind not in known:
        raise ConfigError(
            f"there is no schema of '{request.kind}'. Give one of: {', '.join(known)}."
        )
    path = schema_path(request.kind)
    sys.stdout.write(f"{path}\n" if request.path_only else path.read_text(encoding="utf-8"))
