"""The vehicle's signing key, from a file that nobody else can read or from the environment.

Never from the command line, which every user of a computer sees.
"""

import os
import stat
from collections.abc import Mapping
from pathlib import Path

KEY_VARIABLE = "SITL_SHIM_SIGNING_KEY"
"""Environment variable with the key as 64 hexadecimal digits."""

_KEY_BYTES = 32
_OF_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_LARGEST_FILE_BYTES = 1024


def signing_key(path: Path | None, environment: Mapping[str, str]) -> bytes | None:
    """The key (32 bytes), or None where there is none.

    Args:
        path: of a file with 32 bytes or 64 hexadecimal digits; wins over the environment.
        environment: may hold `KEY_VARIABLE`.

    Raises:
        ValueError: the file can't be read, others could read it, or there is no key in it.
    """
    if path is not None:
        return _of_file(path)
    text = environment.get(KEY_VARIABLE)
    if text is None:
        return None
    key = _of_text(text.strip())
    if key is None:
        raise ValueError(f"{KEY_VARIABLE}: a key is 64 hexadecimal digits, not all of them zero")
    return key


def _of_file(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            # Of the open file: nobody can exchange it between the look and the reading.
            mode = os.fstat(file.fileno()).st_mode
            if os.name == "posix" and stat.S_ISREG(mode) and mode & _OF_OTHERS:
                raise ValueError(
                    f"{path}: others may read or change it (mode {stat.S_IMODE(mode):04o}); a"
                    f" signing key must be its owner's alone: chmod 600 {path}"
                )
            data = file.read(_LARGEST_FILE_BYTES)
    except OSError as error:
        raise ValueError(
            f"{path}: the signing key can't be read: {error.strerror or error}"
        ) from error
    key = data if len(data) == _KEY_BYTES else _of_text(data.strip().decode("ascii", "replace"))
    if key is None or not any(key):
        raise ValueError(
            f"{path}: it holds no signing key: 32 bytes, or 64 hexadecimal digits, not all zero"
        )
    return key


def _of_text(text: str) -> bytes | None:
    """The key that 64 digits are; None for any other text, and for zeros, which mean no key."""
    try:
        key = bytes.fromhex(text) if len(text) == 2 * _KEY_BYTES else b""
    except ValueError:
        return None
    return key if len(key) == _KEY_BYTES and any(key) else None
