"""What the truth tells of faults: a name of at most ten letters, and a number."""

from math import hypot

from sitl_shim.faults.schema import EstimatorReset, Faults
from sitl_shim.faults.vehicle import Occurrence
from sitl_shim.wind.events import Moments
from sitl_shim.wind.happened import Happened

_NAMES = {
    "position_loss": "pos lost",
    "frozen_telemetry": "frozen",
    "clock_jump": "clock",
    "reboot": "reboot",
    "mode": "mode",
    "disarm": "disarm",
    "battery": "battery",
}


def told(occurrence: Occurrence, value: float, stamp_s: float) -> list[Happened]:
    """What is told of a beginning or an end, at a time of the autopilot's clock.

    Args:
        occurrence: what began or ended.
        value: 1 where it begins and 0 where it ends, for what lasts; the clock's jump (s), which
            boot it is, the custom_mode, 1 for a disarming, the share that the battery reports.
        stamp_s: when.
    """
    fault = occurrence.fault
    if isinstance(fault, EstimatorReset):
        return _of_reset(fault, stamp_s)
    return [Happened(stamp_s, _NAMES[fault.fault], value)]


def _of_reset(fault: EstimatorReset, stamp_s: float) -> list[Happened]:
    """``reset`` if it is announced, else ``jump``: metres; and what else steps, m/s and degrees."""
    name = "reset" if fault.announced else "jump"
    found = [Happened(stamp_s, name, hypot(*fault.position_enu_m))]
    if any(fault.velocity_enu_m_s):
        found.append(Happened(stamp_s, "velocity", hypot(*fault.velocity_enu_m_s)))
    if fault.yaw_deg:
        found.append(Happened(stamp_s, "heading", fault.yaw_deg))
    return found


def link_happened(faults: Faults, moments: Moments, time_s: float) -> list[Happened]:
    """The beginnings so far of what the link does: ``link`` with its place in the file, from 1.

    What the link does from the boot on is no event.

    Args:
        faults: the file.
        moments: what the times count from.
        time_s: simulated time.

    Returns:
        With simulated times.
    """
    begun = []
    for number, fault in enumerate(faults.link, start=1):
        begin_s = fault.from_s + (moments.setpoints_s if fault.since == "setpoints" else 0.0)
        if 0.0 < begin_s <= time_s:
            begun.append(Happened(begin_s, "link", float(number)))
    return begun
