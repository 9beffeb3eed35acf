"""The signing key, from a file that nobody else can read or from the environment.

Never from the command line, which every user of a computer sees, and never in a configuration,
which gets copied.
"""

import os
import stat
from collections.abc import Mapping
from pathlib import Path

from companion.config.yaml_source import ConfigError

KEY_VARIABLE = "COMPANION_SIGNING_KEY"
"""Environment variable with the key as 64 hexadecimal digits."""

_KEY_BYTES = 32
_OF_OTHERS = stat.S_IRWXG | stat.S_IRWXO
_LARGEST_FILE_BYTES = 1024
_MAKE_ONE = "(umask 077; openssl rand -hex 32 > signing.key)"


def signing_key(
    key_file: Path | None, environment: Mapping[str, str], *, wanted: bool = False
) -> bytes | None:
    """The key (32 bytes), or None where there is none: packets are not signed then.

    Args:
        key_file: wins over the environment.
        environment: may hold `KEY_VARIABLE`.
        wanted: signing was asked for, so there must be a key.

    Raises:
        ConfigError: the file can't be read, others could read it, or it holds no key; or none was
            found and one was wanted.
    """
    if key_file is not None:
        return _of_file(key_file)
    text = environment.get(KEY_VARIABLE)
    if text is not None:
        key = _of_text(text.strip())
        if key is None:
            raise ConfigError(
                f"{KEY_VARIABLE}: a key is 64 hexadecimal digits, not all of them zero. Make one "
                "with: openssl rand -hex 32"
            )
        return key
    if wanted:
        raise ConfigError(
            "link.signing asks for signed packets, and there is no key. Give its file "
            f"(link.signing.key_file, --signing-key-file) or {KEY_VARIABLE}."
        )
    return None


def _of_file(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            # Of the open file: nobody can exchange it between the look and the reading.
            mode = os.fstat(file.fileno()).st_mode
            if os.name == "posix" and stat.S_ISREG(mode) and mode & _OF_OTHERS:
                raise ConfigError(
                    f"{path}: others may read or change it (mode {stat.S_IMODE(mode):04o}); a "
                    f"signing key must be its owner's alone. Run: chmod 600 {path}"
                )
            data = file.read(_LARGEST_FILE_BYTES)
    except OSError as error:
        raise ConfigError(
            f"{path}: the signing key can't be read: {error.strerror or error}. Make one with: "
            f"{_MAKE_ONE}"
        ) from error
    key = data if len(data) == _KEY_BYTES else _of_text(data.strip().decode("ascii", "replace"))
    if key is None or not any(key):
        raise ConfigError(
            f"{path}: it holds no signing key: 32 bytes, or 64 hexadecimal digits, not all of them "
            f"zero. Make one with: {_MAKE_ONE}"
        )
    return key


def _of_text(text: str) -> bytes | None:
    """The key that 64 digits are; None for any other text, and for zeros, which mean no key."""
    if len(text) != 2 * _KEY_BYTES:
        return None
    try:
        key = bytes.fromhex(text)
    except ValueError:
        return None
    return key if len(key) == _KEY_BYTES and any(key) else None
