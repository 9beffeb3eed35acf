"""Which program made a study's figures."""

import subprocess
from importlib import metadata
from pathlib import Path

import companion


def version() -> str:
    """Of the installed program."""
    try:
        return metadata.version("companion")
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        return "unknown"


def commit() -> str:
    """Of the checkout that the package lies in, with a mark if it is changed; empty elsewhere."""
    folder = Path(companion.__file__).parent.parent
    if not (folder / ".git").exists():
        return ""
    try:
        said = subprocess.run(
            ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=10"],
            capture_output=True,
            text=True,
            timeout=10.0,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return said.stdout.strip()
