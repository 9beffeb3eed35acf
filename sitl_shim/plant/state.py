"""What is true of the vehicle at one instant."""

from dataclasses import dataclass

from sitl_shim.frames import Quaternion, Vector3


# Not frozen, as everything else is: one is made per tick, and freezing costs as much as the plant.
@dataclass(slots=True)
class PlantState:
    """True state of the vehicle; nobody changes one.  World ENU, body FLU."""

    time_s: float
    """Simulated time since the plant was made."""
    position_enu_m: Vector3
    """Centre of mass; z is 0 when the vehicle stands on level ground."""
    velocity_enu_m_s: Vector3
    attitude_flu_to_enu: Quaternion
    """(w, x, y, z), body to world."""
    rate_flu_rad_s: Vector3
    rotor_thrust_n: tuple[float, float, float, float]
    """Thrust of each rotor, in the vehicle file's order."""
    acceleration_enu_m_s2: Vector3
    """Kinematic: 0 at rest, (0, 0, -g) in free fall."""
    wind_acceleration_enu_m_s2: Vector3
    """What the wind adds: drag in this wind less drag in still air, per mass."""
    on_ground: bool
    """Whether anything of the vehicle touches the ground."""
    battery_voltage_v: float
    """At the terminals, under the present load."""
    battery_remaining: float
    """Fraction of the charge, 0 to 1."""
