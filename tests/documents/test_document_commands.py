"""Every command that README and docs show is one that works: it is run as written, or, where that
takes a vehicle, a cluster or many minutes, read by the command line as it is."""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.main import get_command

from tests.documents.document_commands import DOCUMENTS, ROOT, Command, commands_of, files_of
from tests.documents.vehicles import has_vehicle, usual_ports, vehicle_of

PARSED_ONLY = (
    # what is at the other end, or on the disk, is the reader's own
    (r"--connect (?!udpin://127\.0\.0\.1:14540|tcpout:)", "a link of the reader's"),
    (r"^companion (fly|identify|mocap)\b.*--connect\b", "flies; README's is run further down"),
    (r"--vehicle \./|--mission indoors|--name mine|--restore", "files of the reader's"),
    (r"--scheduler\b", "a cluster of the reader's; tests/companion/experiments has one"),
    (r"\b(my-table|own-table)\b", "a file of the reader's"),
    (r"^companion (land|abort|resume)\b", "to a flight that runs; README's is run further down"),
    # minutes of both cores
    (r"^companion paper\b|^companion tune\b", "minutes; tested with less to do"),
    (r"^companion campaign (robustness|map|grid)\b", "minutes; `brief` is run"),
    (r"campaigns/robustness", "of the campaign that takes minutes"),
    (r"^companion faults(?! --only)", "minutes; with `--only` it is run"),
    (r"--perturb\b|--whole\b", "minutes; tested with less to do"),
    (r"^companion compare\b(?!.*--seeds 1\b)", "a minute; with one seed it is run"),
    (r"^companion identify\b(?!.*--lockstep)", "two minutes of real time; in lockstep it is run"),
    (
        r"^companion fly\b(?!.*(--lockstep|--traj 4$|--help|--out flights/eight))",
        "a minute of real time; `--traj 4` is run",
    ),
    (r"^python examples/", "tests/examples does it"),
    (r"^python benchmarks/|^python -m tools\.(soak|fuzz)", "minutes to hours"),
    (r"^python -m tools\.", "writes into the checkout; the tools have tests of their own"),
)
"""Expressions of what is not run, and why."""

UNTIL_ENDED = ("live", "run")
"""These go on until somebody presses Ctrl-C."""

CAUTION = ("check", "certify", "doctor", "replay")
"""These end with 1 for a caution, or for setpoints of another controller."""
MEANT_TO_FAIL = "companion fly --faults my-faults.yaml --lockstep"
"""Ends with 4: for three seconds the vehicle is not heard, and the flight is handed over."""
_CTRL_C = 130


def why_not_run(command: Command) -> str | None:
    """Why a command is parsed only; None if it is run."""
    if command.has_placeholder:
        return "shows a form"
    if command.text in ONCE and command.where != ONCE[command.text]:
        return f"{ONCE[command.text]} is run"
    found = [why for pattern, why in PARSED_ONLY if re.search(pattern, command.text)]
    return found[0] if found else None


CONTINUED = {ROOT / "docs" / "campaigns.md": ROOT / "docs" / "campaign-report.md"}
"""The second document's commands read what the first one's have made."""

ALL = {document: commands_of(document) for document in DOCUMENTS}
SHOWN = [command for commands in ALL.values() for command in commands]
ONCE = {
    command.text: command.where
    for command in reversed(SHOWN)
    if command.text in ("companion fly --traj 4", "companion doctor")
} | {
    command.text: command.where
    for command in ALL[ROOT / "docs" / "campaigns.md"]
    if command.text == "companion campaign brief"
}
"""What several documents show and none goes on from: where it is run."""
RUN = {
    document: [command for command in commands if why_not_run(command) is None]
    for document, commands in ALL.items()
}


def parse_by_typer(app: typer.Typer, argv: tuple[str, ...]) -> None:
    """Read a command as the program does, and run nothing.

    Raises:
        click.ClickException: it is none, or has an option that there is not.
    """
    group = get_command(app)
    with group.make_context(argv[0], list(argv[1:]), resilient_parsing=False) as context:
        name, command, rest = group.resolve_command(
            context, [*context._protected_args, *context.args]
        )
        command.make_context(name, rest, parent=context).close()


@pytest.mark.parametrize("command", SHOWN, ids=lambda command: command.where)
def test_a_command_that_is_shown_can_be_read_by_the_program(command: Command) -> None:
    if command.program == "python":
        module = re.search(r"-m ([\w.]+)", command.text)
        path = module[1].replace(".", "/") if module else command.argv[1]
        there = [ROOT / path, ROOT / f"{path}.py", ROOT / path / "__main__.py"]
        assert any(p.is_file() for p in there), f"{command.where}: {path} is not there"
        return
    if command.program == "bash":
        return
    if command.program == "companion":
        from companion.cli import app
    else:
        from sitl_shim.cli import app
    if {"--help", "--version"} & set(command.argv):
        return  # is run below: parsing it ends the program
    parse_by_typer(app, command.argv)


@pytest.fixture
def environment() -> Iterator[dict[str, str]]:
    """Of a reader: this installation, a narrow terminal, and no other flights than theirs."""
    programs = str(Path(sys.executable).parent)
    with tempfile.TemporaryDirectory() as sockets:
        yield os.environ | {
            "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
            "XDG_RUNTIME_DIR": sockets,
            "COLUMNS": "80",
            "NO_COLOR": "1",
        }


def in_real_time(command: Command) -> bool:
    """Whether a command flies by the clock on the wall."""
    return command.argv[1] == "fly" and not {"--lockstep", "--help"} & set(command.argv)


def documents_to_run() -> list[Any]:
    """Those with commands that are run; what flies on the wall clock is marked."""
    found = []
    for document, commands in RUN.items():
        if commands and document not in CONTINUED.values():
            marks = [pytest.mark.realtime] if any(map(in_real_time, commands)) else []
            name = str(document.relative_to(ROOT))
            found.append(pytest.param(document, marks=marks, id=name))
    return found


@pytest.mark.timeout(600)
@pytest.mark.parametrize("document", documents_to_run())
def test_the_commands_of_a_document_run_as_written(
    document: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    """One after the other in one fresh folder, since later ones use what earlier ones made."""
    for name, text in files_of(document).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    commands = RUN[document] + RUN.get(CONTINUED.get(document, Path()), [])
    for command in commands:
        assert shutil.which(command.program, path=environment["PATH"])
        run = run_and_end if command.argv[1] in UNTIL_ENDED else run_to_its_end
        status, told = run(command, tmp_path, environment)
        assert status in may_end_with(command), (
            f"{command.where}: `{command.text}` ended with {status}:\n{told}"
        )


def may_end_with(command: Command) -> tuple[int, ...]:
    """The exit statuses that a reader would not wonder about."""
    if command.text == MEANT_TO_FAIL:
        return (4,)
    if command.argv[1] in UNTIL_ENDED:
        return (0, _CTRL_C)
    return (0, 1) if command.argv[1] in CAUTION else (0,)


def run_to_its_end(command: Command, folder: Path, environment: dict[str, str]) -> tuple[int, str]:
    """Exit status, and all that was told."""
    asked = has_vehicle(command.argv)
    with vehicle_of(command.argv, folder) if asked else contextlib.nullcontext():
        done = subprocess.run(
            ("bash", "-c", command.text),
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    return done.returncode, done.stdout


def run_and_end(command: Command, folder: Path, environment: dict[str, str]) -> tuple[int, str]:
    """The same with Ctrl-C once it says something: what goes on until then is up by that."""
    with (
        usual_ports(),
        subprocess.Popen(
            ("bash", "-c", f"exec {command.text}"),
            cwd=folder,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ) as process,
    ):
        assert process.stdout is not None
        told = process.stdout.readline()
        process.send_signal(signal.SIGINT)
        told += process.stdout.read()
    return process.returncode, told


@pytest.mark.realtime
@pytest.mark.timeout(300)
def test_a_vehicle_of_the_readers_flies_and_lands_by_the_commands_of_the_readme(
    tmp_path: Path, environment: dict[str, str]
) -> None:
    commands = [c for c in ALL[ROOT / "README.md"] if c.program == "companion"]
    fly = next(c for c in commands if c.argv[1] == "fly" and has_vehicle(c.argv))
    land = next(c for c in commands if c.argv[1] == "land")
    where = {"cwd": tmp_path, "env": environment, "text": True}
    with (
        vehicle_of(fly.argv, tmp_path),
        subprocess.Popen(
            ("bash", "-c", fly.text), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **where
        ) as flight,
    ):
        assert flight.stdout is not None
        told = []
        for line in flight.stdout:
            told.append(line)
            if " approach" in line:
                break
        answer = subprocess.run(
            ("bash", "-c", land.text), capture_output=True, check=False, **where
        )
        told += flight.stdout
        ended = flight.wait()
    assert answer.returncode == 0, answer.stdout + answer.stderr + "".join(told)
    assert ended == 0, "".join(told)
    assert re.search(r"^outcome +landed", "".join(told), re.MULTILINE), "".join(told)


def test_what_is_run_is_not_little() -> None:
    """A rule that takes too much would let every document rot."""
    run = sum(len(commands) for commands in RUN.values())
    assert run >= 70, [command.text for commands in RUN.values() for command in commands]
