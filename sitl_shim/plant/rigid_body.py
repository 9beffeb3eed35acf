"""A vehicle's rigid body: what its equations of motion need to know of it.

The equations themselves are in `sitl_shim.plant.equations`.
"""

from collections.abc import Callable

from sitl_shim.frames import Quaternion, Vector3
from sitl_shim.plant import equations
from sitl_shim.plant.equations import Body, Motion, MotionRate, Wrench
from sitl_shim.plant.vehicle import GRAVITY_M_S2, VehicleModel

__all__ = [
    "Derivative",
    "Motion",
    "MotionRate",
    "body_of",
    "make_derivative",
    "make_drag_acceleration",
    "runge_kutta_step",
]


def body_of(vehicle: VehicleModel) -> Body:
    """What the equations know of a vehicle."""
    mass = vehicle.mass_kg
    drag = vehicle.drag
    dx, dy, dz = (value / mass for value in drag.linear_n_s_m)
    return (
        1.0 / mass,
        *vehicle.inertia_kg_m2,
        dx,
        dy,
        dz,
        drag.quadratic_n_s2_m2 / mass,
        *drag.angular_n_m_s,
        GRAVITY_M_S2,
    )


class Derivative:
    """The equations of motion of one body.

    Args:
        body: that moves.
    """

    __slots__ = ("body",)

    def __init__(self, body: Body) -> None:
        self.body = body

    def __call__(self, motion: Motion, wrench: Wrench, wind: Vector3) -> MotionRate:
        """Of motion, wrench of the rotors and wind (ENU, m/s)."""
        return equations.derivative(self.body, motion, wrench, wind)


def make_derivative(vehicle: VehicleModel) -> Derivative:
    """The equations of motion of a vehicle."""
    return Derivative(body_of(vehicle))


def make_drag_acceleration(vehicle: VehicleModel) -> Callable[[Quaternion, Vector3], Vector3]:
    """Drag per mass (m/s2, ENU) of an attitude and a velocity relative to the air (ENU)."""
    body = body_of(vehicle)

    def drag(attitude: Quaternion, relative: Vector3) -> Vector3:
        return equations.drag_acceleration(body, *attitude, *relative)

    return drag


def runge_kutta_step(
    derivative: Derivative,
    motion: Motion,
    first: MotionRate,
    wrench_mid: Wrench,
    wrench_end: Wrench,
    wind: Vector3,
    step_s: float,
) -> tuple[Vector3, Motion]:
    """One step of a body's motion, see `equations.runge_kutta_step`."""
    return equations.runge_kutta_step(
        derivative.body, motion, first, wrench_mid, wrench_end, wind, step_s
    )
