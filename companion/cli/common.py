"""What the commands have in common: exit statuses, bad input, numbers or names."""

from enum import IntEnum

import typer


class ExitStatus(IntEnum):
    """What the exit status says."""

    LANDED = 0
    NOT_CERTIFIED = 1
    """Of `check`: warnings, and nothing worse."""
    BAD_INPUT = 2
    REFUSED = 3
    ABORTED = 4


def bad_input(error: Exception) -> typer.Exit:
    """Tell what is wrong with what was asked for; the exit to raise."""
    typer.echo(f"error: {error}", err=True)
    return typer.Exit(ExitStatus.BAD_INPUT)


def number_or_text(text: str | None) -> int | str | None:
    """A number where the text is one, else the text: a trajectory by number, or its file."""
    try:
        return None if text is None else int(text)
    except ValueError:
        return text


def number_or_file(text: str) -> int | str:
    """The same of a text that is there."""
    found = number_or_text(text.strip())
    assert found is not None
    return found
