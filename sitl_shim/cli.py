"""Command line of the shim: parse, start, show."""

import asyncio
import contextlib
import os
import signal
import stat
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from sitl_shim.autopilot.flavours import flavours
from sitl_shim.key_file import KEY_VARIABLE, signing_key
from sitl_shim.mavlink.streams import LinkKind
from sitl_shim.server import (
    LOOPBACK,
    BoundLink,
    PortError,
    TcpServer,
    UdpLink,
    default_links,
    serve,
)
from sitl_shim.simulation import ShimOptions

app = typer.Typer(
    help="A quadrotor, its wind and its autopilot, in software, seen over MAVLink alone.",
    no_args_is_help=True,
    add_completion=False,
)

_KINDS = {"onboard": LinkKind.ONBOARD, "gcs": LinkKind.GROUND_STATION}
_BAD_INPUT = 2


@app.callback()
def _root() -> None:
    """Keep `run` a command of its own."""


@app.command()
def run(
    autopilot: Annotated[
        str, typer.Option(help=f"Flavour of the autopilot: {', '.join(flavours())}.")
    ] = "px4",
    vehicle: Annotated[
        str, typer.Option(help="Vehicle: bebop2, x500, sih_quadx, arducopter, or a YAML file.")
    ] = "bebop2",
    scenario: Annotated[
        str,
        typer.Option(
            help="Wind, events: calm, fan-1 … fan-5, gusts, wind3, mass-step, payload-drop, "
            "gust-front, weak-motor, or a YAML file."
        ),
    ] = "calm",
    faults: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="What goes wrong: bad-link (loses a third of the packets), slow-link, or a YAML "
            "file, or its text: '{link: [{loss: 0.1}]}'. See docs/faults.md.",
        ),
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Sensors, not the vehicle's own: mocap, gnss, exact, or a file."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Draws everything that is random.")] = 0,
    speed: Annotated[
        float, typer.Option(min=0.01, max=100.0, help="Simulated seconds per second.")
    ] = 1.0,
    boot_scale: Annotated[
        float,
        typer.Option(min=0.01, max=10.0, help="Stretches ArduPilot's boot: 40 s to a position."),
    ] = 1.0,
    system_id: Annotated[int, typer.Option(min=1, max=250, help="MAVLink system id.")] = 1,
    instance: Annotated[
        int, typer.Option(min=0, max=99, help="Shifts the default ports, as PX4's instances.")
    ] = 0,
    onboard_port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Onboard link, to bind [14580]; 0: any.")
    ] = None,
    onboard_remote: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Where it speaks first [14540].")
    ] = None,
    gcs_port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Ground station link [18570]; 0: any.")
    ] = None,
    gcs_remote: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Where it speaks first [14550].")
    ] = None,
    extra_link: Annotated[
        list[str] | None,
        typer.Option(metavar="KIND:PORT:REMOTE", help="A further link: onboard or gcs, ports."),
    ] = None,
    tcp_port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="A further, onboard link: listens on TCP [none]."),
    ] = None,
    mocap_port: Annotated[
        int | None,
        typer.Option(min=1, max=65535, help="Stream the true pose as UDP/JSON to this port."),
    ] = None,
    bind: Annotated[str, typer.Option(help="Address of the sockets.")] = LOOPBACK,
    parameter: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE", help="Autopilot parameter; may be repeated."),
    ] = None,
    signing_key_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Sign packets, and read only signed ones: 32 bytes or 64 hex digits, mode 600."
            f" Else the key in {KEY_VARIABLE}, if any.",
        ),
    ] = None,
    exit_with_parent: Annotated[
        bool,
        typer.Option(
            "--exit-with-parent", help="End when standard input closes: no orphan stays behind."
        ),
    ] = False,
) -> None:
    """Boot a vehicle and answer over UDP until interrupted."""
    try:
        if exit_with_parent:
            _require_stdin_that_closes()
        options = ShimOptions(
            autopilot=autopilot,
            vehicle=vehicle,
            scenario=scenario,
            faults=faults,
            sensors=sensors,
            seed=seed,
            system_id=system_id,
            speed=speed,
            boot_scale=boot_scale,
            parameters=dict(_parse_parameter(text) for text in parameter or ()),
            signing_key=signing_key(signing_key_file, os.environ),
        )
        ground, onboard = default_links(instance)
        links: list[UdpLink | TcpServer] = [
            _with_ports(ground, gcs_port, gcs_remote),
            _with_ports(onboard, onboard_port, onboard_remote),
            *(_parse_link(text) for text in extra_link or ()),
            *([] if tcp_port is None else [TcpServer(LinkKind.ONBOARD, tcp_port)]),
        ]
        asyncio.run(
            _serve_until_told(
                options, links, bind, exit_with_parent=exit_with_parent, mocap_port=mocap_port
            )
        )
    except PortError as error:
        _refuse(error.strerror or str(error))
    except ValueError as error:
        _refuse(str(error))


async def _serve_until_told(
    options: ShimOptions,
    links: Sequence[UdpLink | TcpServer],
    host: str,
    *,
    exit_with_parent: bool,
    mocap_port: int | None = None,
) -> None:
    """Serve until SIGINT, SIGTERM or, if so asked, the end of standard input."""
    loop = asyncio.get_running_loop()
    task = asyncio.ensure_future(
        serve(
            options,
            links,
            host=host,
            ready=lambda bound: _say_ready(options, bound),
            mocap_port=mocap_port,
            rejected=_say_rejected,
        )
    )
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    watch = asyncio.ensure_future(_stdin_closed()) if exit_with_parent else None
    if watch is not None:
        watch.add_done_callback(lambda _: task.cancel())
    with contextlib.suppress(asyncio.CancelledError):
        await task
    if watch is not None:
        watch.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await watch


def _require_stdin_that_closes() -> None:
    """Refuse a standard input that is absent, or whose end says nothing of the parent's."""
    try:
        # None if the process was started with a closed one.
        fits = sys.stdin is not None and _closes_with_its_writer(sys.stdin.fileno())
    except (OSError, ValueError):
        fits = False
    if not fits:
        raise ValueError(
            "--exit-with-parent needs a pipe, a socket or a terminal as standard input, which"
            " the parent keeps open; /dev/null, a file or none at all will not do"
        )


def _closes_with_its_writer(descriptor: int) -> bool:
    mode = os.fstat(descriptor).st_mode
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode) or os.isatty(descriptor)


async def _stdin_closed() -> None:
    """Wait for the end of standard input."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(4096):
        pass


def _say_ready(options: ShimOptions, bound: Sequence[BoundLink]) -> None:
    links = ", ".join(
        f"{link.kind.value} {link.local[0]}:{link.local[1]}->{link.remote[1]}" for link in bound
    )
    hurt = "" if options.faults is None else f" with {_faults_in_short(options.faults)}"
    typer.echo(
        f"ready: {options.autopilot} {options.vehicle} in {options.scenario}{hurt},"
        f" seed {options.seed}, {links}"
    )
    sys.stdout.flush()


def _faults_in_short(faults: str | Path) -> str:
    text = str(faults)
    return "faults" if text.lstrip().startswith("{") else text


def _say_rejected(counts: Mapping[str, int]) -> None:
    if counts:
        listed = ", ".join(f"{count} {reason}" for reason, count in sorted(counts.items()))
        typer.echo(f"sitl-shim: packets that were not read: {listed}", err=True)


def _with_ports(link: UdpLink, port: int | None, remote: int | None) -> UdpLink:
    return UdpLink(
        link.kind,
        link.port if port is None else port,
        link.remote_port if remote is None else remote,
    )


def _parse_link(text: str) -> UdpLink:
    kind, _, ports = text.partition(":")
    port, _, remote = ports.partition(":")
    if kind not in _KINDS or not _is_port(port) or not _is_port(remote) or int(remote) == 0:
        raise ValueError(
            f"--extra-link {text!r}: expected KIND:PORT:REMOTE, for instance gcs:18571:14551"
        )
    return UdpLink(_KINDS[kind], int(port), int(remote))


def _is_port(text: str) -> bool:
    return text.isascii() and text.isdigit() and int(text) <= 65535


def _parse_parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError:
        raise ValueError(f"--parameter {text!r}: expected NAME=VALUE with a number") from None


def _refuse(reason: str) -> None:
    typer.echo(f"sitl-shim: {reason}", err=True)
    raise typer.Exit(_BAD_INPUT)


def main() -> None:
    """Entry point of the console script."""
    app()
