"""What the commands have in common: exit statuses, bad input, numbers or names."""

import shutil
import sys
import textwrap
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
    tell_error(error)
    return typer.Exit(ExitStatus.BAD_INPUT)


def tell_error(error: Exception) -> None:
    """Say it on standard error; on a terminal lines end between words."""
    text = f"error: {error}"
    if sys.stderr.isatty():
        text = wrapped(text, shutil.get_terminal_size().columns)
    typer.echo(text, err=True)


def wrapped(text: str, columns: int) -> str:
    """A text whose lines are no longer than a terminal has columns, if its words are not."""
    return "\n".join(
        textwrap.fill(
            line,
            width=columns,
            subsequent_indent="  ",
            break_long_words=False,
            break_on_hyphens=False,
        )
        for line in text.split("\n")
    )


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
