"""Whether an autopilot's parameters let it fly on poses from outside.

PX4: docs.px4.io/main/en/ros/external_position_estimation.html and its parameter reference.
ArduPilot: ardupilot.org/dev/docs/mavlink-nongps-position-estimation.html, and its parameters.
"""

from collections.abc import Mapping
from typing import Literal, NamedTuple

Autopilot = Literal["px4", "ardupilot"]


class Misfit(NamedTuple):
    """A parameter that does not fit."""

    name: str
    value: float | None
    """None: the autopilot has none of this name."""
    wanted: float
    why: str


class _Wanted(NamedTuple):
    name: str
    value: float
    why: str
    bits: int = 0
    """If not 0: only these bits must be set."""
    also: tuple[float, ...] = ()
    """Other values that do as well."""


_PX4 = (
    _Wanted(
        "EKF2_EV_CTRL",
        15,
        "horizontal position, height and yaw are to come from outside (bits 1, 2, 8)",
        bits=11,
    ),
    _Wanted("EKF2_GPS_CTRL", 0, "satellites beside it would stay the reference of position"),
    _Wanted("EKF2_HGT_REF", 3, "else the height is the barometer's or the satellites'"),
)
_ARDUPILOT = (
    _Wanted("VISO_TYPE", 1, "else poses over MAVLink are not read; needs a restart"),
    _Wanted("EK3_SRC1_POSXY", 6, "the horizontal position is to come from outside"),
    _Wanted("EK3_SRC1_POSZ", 6, "the height is to come from outside"),
    _Wanted("EK3_SRC1_YAW", 6, "the yaw is to come from outside, not from a compass indoors"),
    _Wanted("EK3_SRC1_VELXY", 0, "no velocity is sent, and satellites are not there", also=(6,)),
    _Wanted("EK3_SRC1_VELZ", 0, "no velocity is sent, and satellites are not there", also=(6,)),
)
_WANTED: dict[Autopilot, tuple[_Wanted, ...]] = {"px4": _PX4, "ardupilot": _ARDUPILOT}


def parameter_names(autopilot: Autopilot) -> tuple[str, ...]:
    """The parameters that matter for motion capture."""
    return tuple(wanted.name for wanted in _WANTED[autopilot])


def misfits(autopilot: Autopilot, values: Mapping[str, float]) -> tuple[Misfit, ...]:
    """What of an autopilot's parameters does not fit motion capture.

    Args:
        autopilot: which one.
        values: of `parameter_names`, as far as it has them.
    """
    found = []
    for wanted in _WANTED[autopilot]:
        value = values.get(wanted.name)
        if value is not None and _fits(wanted, value):
            continue
        found.append(Misfit(wanted.name, value, wanted.value, wanted.why))
    return tuple(found)


def _fits(wanted: _Wanted, value: float) -> bool:
    if wanted.bits:
        return int(value) & wanted.bits == wanted.bits
    return value in (wanted.value, *wanted.also)
