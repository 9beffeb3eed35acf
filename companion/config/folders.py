"""Where the shipped configurations lie.  It imports nothing heavy: shell completion asks it."""

from pathlib import Path

import companion


def configs_folder() -> Path:
    """The shipped configurations: inside the installed package, or beside it in a checkout."""
    package = Path(companion.__file__).parent
    installed = package / "_configs"
    return installed if installed.is_dir() else package.parent / "configs"


def shipped_names(kind: str) -> list[str]:
    """Names of the shipped configurations of a kind ("vehicle", "scenario", …), sorted."""
    return sorted(path.stem for path in (configs_folder() / f"{kind}s").glob("*.yaml"))


def shipped_controllers() -> list[str]:
    """Names of the shipped controllers, sorted; each is a folder with a file for each vehicle."""
    folder = configs_folder() / "controllers"
    return sorted(path.name for path in folder.iterdir() if path.is_dir())


def schema_path(kind: str) -> Path:
    """The shipped JSON Schema of a kind of file ("mission", …)."""
    return configs_folder() / "schemas" / f"{kind}.json"
