"""How what is missing gets into the environment that this program runs in."""

import shlex
import shutil
import sys
from importlib.util import find_spec
from pathlib import Path


def install_extra(name: str) -> str:
    """The command that installs one of the project's extras where this program runs.

    A wheel or a checkout that is installed already is kept: only what it lacks is fetched.

    Args:
        name: as in pyproject.toml.
    """
    return f"{pip_install()} 'companion[{name}]'"


def pip_install() -> str:
    """How packages are installed where this program runs.

    Plain `pip install` where that is this environment's; else with the path of this Python, since
    pipx and uv keep a program in an environment that is not on the PATH, uv in one without pip.
    """
    here = Path(sys.executable)
    pip = shutil.which("pip")
    if pip is not None and Path(pip).parent == here.parent:
        return "pip install"
    if find_spec("pip") is not None:
        return f"{shlex.quote(str(here))} -m pip install"
    return f"uv pip install --python {shlex.quote(str(here))}"
