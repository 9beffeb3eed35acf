"""What ``companion certify`` does: read, reckon, draw, tell."""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from rich.console import Console

from companion.config.resolve import FlightConfig, load_flight
from companion.config.yaml_source import ConfigError, settings_of
from companion.experiments.certified import certificate_subject, plus_subject
from companion.theory.certificate import certify
from companion.theory.certificate_figure import draw_certificate
from companion.theory.certificate_record import certificate_record
from companion.theory.certificate_table import print_certificate
from companion.theory.envelope import Air
from companion.theory.plus_certificate import certify_plus
from companion.theory.plus_figure import draw_plus_certificate
from companion.theory.plus_record import plus_record
from companion.theory.plus_table import print_plus_certificate

JSON_NAME, FIGURE_NAME = "certificate.json", "certificate.png"
_WIDE = 160
_STRONGEST_WIND_M_S = 50.0


class BadInputError(Exception):
    """What was asked for can't be certified; the text names what, where and the remedy."""


@dataclass(frozen=True, slots=True)
class CertifyRequest:
    """The options of the command line."""

    controller: str
    """Name, or path of a YAML file."""
    vehicle: str = "bebop2"
    """Name, or path of a YAML file."""
    rate_hz: float | None = None
    """Of the state's samples; None for the missions' default."""
    wind_m_s: float = Air().wind_m_s
    """Largest wind that the drag's Lipschitz constant and the bounds reckon with."""
    settings: tuple[str, ...] = ()
    """``KEY=VALUE`` each, as for ``fly``: controller.KEY, vehicle.KEY, or of a mission."""
    out: Path | None = None
    """Folder of certificate.json and certificate.png; None to write nothing."""
    json_output: bool = False


def run_certify(request: CertifyRequest) -> bool:
    """Certify as asked and tell about it.

    Returns:
        Whether every condition holds.

    Raises:
        BadInputError: there is nothing to certify, or nowhere to write.
    """
    if not 0.0 <= request.wind_m_s <= _STRONGEST_WIND_M_S:
        raise BadInputError(
            f"--wind {request.wind_m_s:g}: give a speed from 0 to {_STRONGEST_WIND_M_S:g} m/s."
        )
    if request.out is not None and request.out.exists() and not request.out.is_dir():
        raise BadInputError(
            f"{request.out}: can't be written: a file has that name. Choose another folder with "
            "--out."
        )
    try:
        config = _load(request)
        certified = _certified(config, request)
    except ConfigError as error:
        raise BadInputError(str(error)) from error
    except ValueError as error:
        raise BadInputError(f"{request.controller}: {error}.") from error
    text = json.dumps(certified.record, allow_nan=False, ensure_ascii=False)
    if request.out is not None:
        try:
            request.out.mkdir(parents=True, exist_ok=True)
            (request.out / JSON_NAME).write_text(text + "\n", encoding="utf-8")
            certified.draw(request.out / FIGURE_NAME)
        except OSError as error:
            raise BadInputError(
                f"{request.out}: can't be written: {error.strerror or error}. "
                "Choose another folder with --out."
            ) from error
    if request.json_output:
        sys.stdout.write(text + "\n")
    else:
        console = _console(sys.stdout)
        certified.tell(console)
        if request.out is not None:
            console.print(f"files: {request.out / JSON_NAME}, {request.out / FIGURE_NAME}")
    return certified.holds


@dataclass(frozen=True, slots=True)
class _Certified:
    """A certificate of either kind, ready to be told."""

    holds: bool
    record: dict[str, Any]
    draw: Callable[[Path], None]
    tell: Callable[[Console], None]


def _certified(config: FlightConfig, request: CertifyRequest) -> _Certified:
    title = f"{request.controller} on {config.vehicle.name}"
    framework = config.controller.framework
    if config.controller.plus is not None:
        plus = certify_plus(plus_subject(config, request.wind_m_s))
        return _Certified(
            plus.holds,
            plus_record(plus, request.controller, framework),
            lambda path: draw_plus_certificate(plus, title, path),
            lambda console: print_plus_certificate(console, plus, title),
        )
    certificate = certify(certificate_subject(config, request.wind_m_s))
    return _Certified(
        certificate.holds,
        certificate_record(certificate, request.controller, framework),
        lambda path: draw_certificate(certificate, title, path),
        lambda console: print_certificate(console, certificate, title),
    )


def _load(request: CertifyRequest) -> FlightConfig:
    overrides: dict[str, object] = {"controller": request.controller, "vehicle": request.vehicle}
    settings = settings_of(request.settings)
    if request.rate_hz is not None:
        settings["state_rate_hz"] = repr(float(request.rate_hz))
    return load_flight(None, overrides, settings)


def _console(stream: TextIO) -> Console:
    """What is not for a terminal is not wrapped."""
    width = None if stream.isatty() else _WIDE
    return Console(file=stream, highlight=False, width=width)
