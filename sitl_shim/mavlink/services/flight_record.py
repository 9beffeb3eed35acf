"""What a log keeps of one moment of a flight."""

from dataclasses import dataclass

from sitl_shim.frames import attitude_to_wire, swap_enu_ned
from sitl_shim.simulation import Simulation


@dataclass(frozen=True, slots=True)
class Record:
    """The autopilot's own view, in its own frames."""

    time_us: int
    """Since boot."""
    position_ned_m: tuple[float, float, float]
    velocity_ned_m_s: tuple[float, float, float]
    attitude_frd_to_ned: tuple[float, float, float, float]
    """(w, x, y, z)."""
    rotor_commands: tuple[float, float, float, float]
    custom_mode: int
    armed: bool


def record_of(sim: Simulation) -> Record:
    """The present moment."""
    estimate, autopilot = sim.estimate, sim.autopilot
    return Record(
        sim.time_us,
        swap_enu_ned(estimate.position_enu_m),
        swap_enu_ned(estimate.velocity_enu_m_s),
        attitude_to_wire(estimate.attitude_flu_to_enu),
        autopilot.rotor_commands,
        autopilot.heartbeat.custom_mode,
        autopilot.armed,
    )
