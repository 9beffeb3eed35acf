"""``companion schema`` on the command line."""

from typing import Annotated

import typer

from companion.cli import completion
from companion.cli.common import bad_input


def schema(
    kind: Annotated[
        str | None,
        typer.Argument(
            help="Kind of file; by default the kinds are listed, with where their schemas lie.",
            metavar="[KIND]",
            autocompletion=completion.schema_kinds,
        ),
    ] = None,
    path: Annotated[
        bool, typer.Option("--path", help="Print where the schema lies, not what it says.")
    ] = False,
) -> None:
    """Print the JSON Schema of a kind of YAML file, by which editors complete and check it.

    An editor finds it by itself in files that have the line `# yaml-language-server: $schema=…`,
    as all have that are shipped, or made by `companion new`.

    Exit status: 0 printed, 2 no such kind.
    """
    from companion.commands.schema import SchemaRequest, run_schema
    from companion.config.yaml_source import ConfigError

    try:
        run_schema(SchemaRequest(kind, path))
    except (ConfigError, OSError) as error:
        raise bad_input(error) from error
