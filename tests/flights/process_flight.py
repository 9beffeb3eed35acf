"""A flight as a user has it: `companion fly` as a process of its own."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from companion.recording.mcap_log import read_records
from tests.flights.bench import SHORT


class Flight:
    """`companion fly` as a process of its own."""

    def __init__(self, folder, *options):
        self.folder = folder / "flight"
        path = folder / "short.csv"
        path.write_text(SHORT)
        environment = os.environ | {"XDG_RUNTIME_DIR": str(folder)}
        command = [sys.executable, "-m", "companion", "fly", "--json", f"--out={self.folder}"]
        command += [f"--traj={path}", "--seed=1", "--set=hover_s=0.2", *options]
        self.process = subprocess.Popen(
            command,
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def press_ctrl_c(self):
        """As a terminal does: to the whole process group, not to the one process."""
        os.killpg(self.process.pid, signal.SIGINT)

    def children(self):
        pid = self.process.pid
        return [int(c) for c in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]

    def events(self):
        with contextlib.suppress(OSError):
            records = read_records(self.folder / "flight.mcap")
            return [r for r in records if r.topic == "event"]
        return []

    def wait_for(self, text, timeout_s=60.0):
        """Until an event with a text is in the log."""
        end = time.monotonic() + timeout_s
        while not any(text in e.values["text"] for e in self.events()):
            assert self.process.poll() is None, self.process.communicate()
            assert time.monotonic() < end, f"no '{text}' in {timeout_s} s"
            time.sleep(0.2)

    def end(self, timeout_s=60.0):
        out, err = self.process.communicate(timeout=timeout_s)
        return json.loads(out) if out else None, err
