"""The command line of the shim: errors that name the remedy, and clean ends."""

import asyncio
import signal
import socket
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from sitl_shim.cli import app, run
from tests.sitl_shim.server.shim_process import free_port, running_shim, start_shim

_FREE = ("--onboard-port=0", "--gcs-port=0")


def _refusal(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["run", *_FREE, *arguments])
    assert result.exit_code == 2
    return result.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vehicle=bebop9"], ["bebop9", "bebop2", "x500"]),
        (["--scenario=storm"], ["storm", "calm"]),
        (["--sensors=lidar"], ["sensor profile", "lidar", "exact", "gnss", "mocap"]),
        (["--autopilot=betaflight"], ["betaflight", "px4"]),
        (["--parameter=NO_SUCH=1"], ["NO_SUCH"]),
        (["--parameter=MC_ROLL_P=-5"], ["MC_ROLL_P", "0 to 30"]),
        (["--parameter=MC_ROLL_P"], ["NAME=VALUE"]),
        (["--extra-link=radio:1:2"], ["KIND:PORT:REMOTE", "gcs:18571:14551"]),
        (["--extra-link=gcs:99999:1"], ["KIND:PORT:REMOTE"]),
    ],
)
def test_bad_input_is_refused_and_the_remedy_named(arguments: list[str], words: list[str]) -> None:
    refusal = _refusal(*arguments)
    assert all(word in refusal for word in words), refusal
    assert "Traceback" not in refusal


def test_a_broken_vehicle_file_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "glider.yaml"
    path.write_text("name: glider\nwings: 2\n")
    assert "glider.yaml" in _refusal(f"--vehicle={path}")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: odd\nwinds:\n  - kind: steady\n    speed: 3\n", ["line 4", "speed", "unknown"]),
        ("name: odd\nwinds: 3\n", ["line 2", "winds"]),
        ("- 1\n", ["mapping", "winds"]),
        ("name: &a [*a]\n", ["nests too deeply"]),
    ],
)
def test_a_scenario_file_that_says_something_else_is_refused_with_the_place(
    tmp_path: Path, text: str, words: list[str]
) -> None:
    path = tmp_path / "breeze.yaml"
    path.write_text(text)
    refusal = _refusal(f"--scenario={path}")
    assert all(word in refusal for word in ["breeze.yaml", *words]), refusal
    assert "Traceback" not in refusal


async def _exit_with_parent(stdin: int) -> tuple[int, str]:
    process = await start_shim(*_FREE, "--exit-with-parent", stdin=stdin)
    try:
        _, stderr = await asyncio.wait_for(process.communicate(), 10.0)
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    assert process.returncode is not None
    return process.returncode, stderr.decode()


async def test_a_parent_that_gives_no_pipe_is_refused_in_one_line(tmp_path: Path) -> None:
    with (tmp_path / "empty").open("w+") as file:
        for stdin in (asyncio.subprocess.DEVNULL, file.fileno()):
            code, stderr = await _exit_with_parent(stdin)
            assert code == 2
            assert stderr.count("\n") == 1
            assert "--exit-with-parent needs a pipe" in stderr


def test_no_standard_input_at_all_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(typer.Exit) as caught:
        run(onboard_port=0, gcs_port=0, exit_with_parent=True)
    assert caught.value.exit_code == 2


@pytest.mark.realtime
async def test_it_ends_when_its_parent_closes_the_socket() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        process = await start_shim(*_FREE, "--exit-with-parent", stdin=theirs.fileno())
        try:
            assert process.stdout is not None
            assert await asyncio.wait_for(process.stdout.readline(), 20.0)
            theirs.close()
            ours.close()
            assert await asyncio.wait_for(process.wait(), 10.0) == 0
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()


def test_a_port_in_use_is_named() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        assert f"UDP port {port}" in _refusal(f"--onboard-port={port}")


def test_help_names_the_options() -> None:
    result = CliRunner().invoke(app, ["run", "--help"], env={"COLUMNS": "200"})
    assert result.exit_code == 0
    for option in (
        "--vehicle",
        "--scenario",
        "--sensors",
        "--seed",
        "--speed",
        "--onboard-port",
        "--bind",
    ):
        assert option in result.output


@pytest.mark.realtime
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_a_signal_ends_it_cleanly(number: signal.Signals) -> None:
    async with running_shim(*_FREE) as (process, line):
        assert line.startswith("ready: px4 bebop2")
        process.send_signal(number)
        assert await asyncio.wait_for(process.wait(), 10.0) == 0
        assert process.stderr is not None
        assert await process.stderr.read() == b""


@pytest.mark.realtime
async def test_it_ends_when_its_parent_closes_the_pipe() -> None:
    async with running_shim(*_FREE, "--exit-with-parent") as (process, _):
        assert process.stdin is not None
        process.stdin.close()
        assert await asyncio.wait_for(process.wait(), 10.0) == 0


@pytest.mark.realtime
async def test_the_ready_line_names_every_link() -> None:
    port = free_port()
    async with running_shim(*_FREE, f"--extra-link=gcs:{port}:14551") as (_, line):
        assert f"127.0.0.1:{port}->14551" in line
        assert "->14540" in line
        assert "->14550" in line
