"""Where texts are shown: a terminal as wide as it is, a file as wide as a plain terminal."""

from typing import TextIO

from rich.console import Console

WIDTH = 80
"""Columns of what is not a terminal: tables read well in a log, a mail, or a bug report."""


def plain_console(stream: TextIO) -> Console:
    """A console on a stream, without rich's own colouring of numbers and words.

    Args:
        stream: standard output or error; colours are left out where it is no terminal, or where
            NO_COLOR or TERM=dumb say so.
    """
    return Console(file=stream, highlight=False, width=None if stream.isatty() else WIDTH)
