"""Writing a file so that nobody ever finds half of it."""

import os
from collections.abc import Callable
from pathlib import Path


def write_whole(path: Path, text: str) -> None:
    """Write a text file so that whoever looks sees the old one or the new one.

    Raises:
        OSError: it can't be written.
    """
    made_whole(path, lambda unfinished: unfinished.write_text(text, encoding="utf-8"))


def made_whole(path: Path, make: Callable[[Path], object]) -> None:
    """Make a file so that whoever looks sees the old one or the new one, after a power cut too.

    Args:
        path: of the file; its folder is made.
        make: writes it to the path that it is given, which ends as `path` does.

    Raises:
        OSError: it can't be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(f".unfinished.{path.name}")
    try:
        make(unfinished)
        _sync(unfinished)
        unfinished.replace(path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def _sync(path: Path) -> None:
    """Let a file's content reach the disk: else a power cut may leave its name without it."""
    file = os.open(path, os.O_RDONLY)
    try:
        os.fsync(file)
    finally:
        os.close(file)
