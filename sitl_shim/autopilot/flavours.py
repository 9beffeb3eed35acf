"""The autopilots that the shim can play, by name.  A new flavour is registered here."""

from collections.abc import Callable, Mapping
from math import nan

from sitl_shim.autopilot.ardupilot.autopilot import ArduCopter
from sitl_shim.autopilot.ardupilot.modes import mode_named as ardupilot_mode_named
from sitl_shim.autopilot.interface import Autopilot, Command
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.autopilot.px4.autopilot import Px4Autopilot
from sitl_shim.autopilot.px4.modes import mode_named as px4_mode_named
from sitl_shim.autopilot.px4.parameters import aiding_of as px4_aiding
from sitl_shim.autopilot.px4.parameters import scale_timeouts
from sitl_shim.sensors.aiding import Aiding


def _make_px4(
    overrides: Mapping[str, float],
    *,
    seed: int,
    origin_altitude_amsl_m: float,
    airborne: bool,
    speed: float,
    boot_scale: float,
) -> Autopilot:
    return Px4Autopilot(
        scale_timeouts(overrides, speed),
        seed=seed,
        origin_altitude_amsl_m=origin_altitude_amsl_m,
        airborne=airborne,
    )


def _make_ardupilot(
    overrides: Mapping[str, float],
    *,
    seed: int,
    origin_altitude_amsl_m: float,
    airborne: bool,
    speed: float,
    boot_scale: float,
) -> Autopilot:
    return ArduCopter(
        {"SIM_SPEEDUP": speed, **overrides},
        seed=seed,
        origin_altitude_amsl_m=origin_altitude_amsl_m,
        airborne=airborne,
        boot_scale=boot_scale,
    )


_FLAVOURS: dict[str, Callable[..., Autopilot]] = {
    "px4": _make_px4,
    "ardupilot": _make_ardupilot,
}


def aiding_of(flavour: str, parameters: ParameterStore) -> Aiding:
    """What an autopilot's parameters tell its estimator to lean on."""
    return px4_aiding(parameters) if flavour == "px4" else Aiding()


_CMD_SET_MODE = 176
_CUSTOM_MODE_ENABLED = 1.0
_SYSTEM_ID = {"px4": "MAV_SYS_ID", "ardupilot": "MAV_SYSID"}
_SAID_OTHERWISE = {
    **dict.fromkeys(_SYSTEM_ID.values(), "--system-id"),
    "SIM_SPEEDUP": "--speed",
}
"""Parameters that only tell what an option says."""


def flavours() -> tuple[str, ...]:
    """Names of the flavours."""
    return tuple(_FLAVOURS)


def mode_number(flavour: str, name: str) -> int:
    """The custom_mode of a flavour's mode, by its name.

    Raises:
        ValueError: it has no mode of this name; the text says which there are.
    """
    return int(px4_mode_named(name) if flavour == "px4" else ardupilot_mode_named(name))


def mode_command(flavour: str, custom_mode: int) -> Command:
    """The DO_SET_MODE by which a ground station asks for a mode."""
    number = (float(custom_mode), 0.0)
    if flavour == "px4":
        number = (float(custom_mode >> 16 & 0xFF), float(custom_mode >> 24))
    return Command(_CMD_SET_MODE, (_CUSTOM_MODE_ENABLED, *number, nan, nan, nan, nan))


def make_autopilot(
    flavour: str,
    overrides: Mapping[str, float],
    *,
    seed: int,
    origin_altitude_amsl_m: float,
    airborne: bool,
    speed: float,
    boot_scale: float,
    system_id: int = 1,
) -> Autopilot:
    """Make an autopilot of a flavour.

    Args:
        flavour: its name.
        overrides: parameters that differ from its defaults.
        seed: of what is random in its answers.
        origin_altitude_amsl_m: altitude of the local frame's origin.
        airborne: begin booted, armed and holding in the air.
        speed: simulated seconds per second of a client's clock; time-outs that wait for a
            client stretch with it.
        boot_scale: the times of the boot are multiplied by it, where the flavour's is long.
        system_id: of MAVLink, which a parameter tells.

    Raises:
        ValueError: there is no such flavour, no such parameter, or one that only tells what an
            option says.
    """
    make = _FLAVOURS.get(flavour)
    if make is None:
        raise ValueError(f"unknown autopilot {flavour!r}: there are {', '.join(_FLAVOURS)}")
    for name, option in _SAID_OTHERWISE.items():
        if name in overrides:
            raise ValueError(f"{name} is not set as a parameter here: say it with {option}")
    autopilot = make(
        overrides,
        seed=seed,
        origin_altitude_amsl_m=origin_altitude_amsl_m,
        airborne=airborne,
        speed=speed,
        boot_scale=boot_scale,
    )
    autopilot.parameters.learn(_SYSTEM_ID[flavour], system_id)
    return autopilot
