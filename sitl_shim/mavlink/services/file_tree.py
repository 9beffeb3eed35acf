"""The files that a client may see: logs, and what the flavour makes up when it is asked for."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

Reader = Callable[[str], bytes]
"""Gives the content of a file; takes the query after the name's question mark."""


class ListedFile(NamedTuple):
    """A file in a directory."""

    size_bytes: int
    read: Callable[[], bytes]


class FileTree:
    """A tree of files that nobody can write to.

    Args:
        special: files that are no part of any directory, by name.
        listed: gives the files that are, by path from the root, without a leading slash.
    """

    def __init__(
        self,
        special: Mapping[str, Reader],
        listed: Callable[[], Mapping[str, ListedFile]],
    ) -> None:
        self._special = special
        self._listed = listed

    def read(self, path: str) -> bytes | None:
        """The content of a file; None if there is none."""
        name, _, query = path.partition("?")
        reader = self._special.get(name)
        if reader is not None:
            return reader(query)
        file = self._listed().get(_normal(name))
        return None if file is None else file.read()

    def list(self, path: str) -> Sequence[str] | None:
        """The entries of a directory as MAVLink FTP writes them; None if there is none.

        A directory is `Dname`, a file `Fname`, a tab and its size.
        """
        where = _normal(path)
        prefix = f"{where}/" if where else ""
        files = self._listed()
        entries: dict[str, str] = {}
        for each, file in files.items():
            if not each.startswith(prefix):
                continue
            name, slash, _ = each[len(prefix) :].partition("/")
            entries[name] = f"D{name}" if slash else f"F{name}\t{file.size_bytes}"
        if not entries and where:
            return None
        return [entries[name] for name in sorted(entries)]


def _normal(path: str) -> str:
    """A path without leading, trailing or repeated slashes and dots that mean nothing."""
    return "/".join(part for part in path.split("/") if part not in ("", "."))
