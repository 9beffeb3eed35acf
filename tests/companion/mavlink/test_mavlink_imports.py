"""What the MAVLink room may not need, checked in fresh interpreters."""

import subprocess
import sys
from pathlib import Path

import pytest

import companion.mavlink


def modules_after(statement):
    code = f"import sys; {statement}; sys.stdout.write(' '.join(sys.modules))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_the_slow_dialect_is_imported_by_one_module_alone():
    folder = Path(companion.mavlink.__file__).parent
    importers = [
        path.name
        for path in sorted(folder.rglob("*.py"))
        if "pymavlink.dialects" in path.read_text() or "mavutil" in path.read_text()
    ]

    assert importers == ["dialect.py"]


@pytest.mark.parametrize(
    "module", ["companion.link.udp", "companion.link.memory", "companion.recording.flight_log"]
)
def test_links_and_recording_do_not_need_the_dialect(module):
    assert not any(name.startswith("pymavlink") for name in modules_after(f"import {module}"))


def test_no_module_of_ours_imports_asyncio_or_sockets():
    folder = Path(companion.mavlink.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        text = path.read_text()
        assert "asyncio" not in text, path
        assert "import socket" not in text, path
        assert "import time\n" not in text, path
