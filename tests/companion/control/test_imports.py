"""What importing the control laws brings along: nothing that a tick does not use."""

import subprocess
import sys

HEAVY = ("scipy", "matplotlib", "dask", "osqp", "daqp")
PROGRAM = f"""
import importlib, pkgutil, sys
import companion.control as room
for module in pkgutil.walk_packages(room.__path__, "companion.control."):
    importlib.import_module(module.name)
print(*sorted(name for name in {HEAVY} if name in sys.modules))
"""


def test_importing_every_control_law_pulls_in_no_heavy_library():
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True
    )
    assert ran.stdout.split() == []
