"""A controller of one's own, flown along trajectory 4 through a fan's jet, beside mpc-l1.

The controller is a geometric one: the acceleration that it wants tells where the thrust must point
and how strong it must be.  Run it with `python own_controller.py`; it writes own_controller.png.
"""

import numpy as np

from companion.api import AttitudeSetpoint, ControlSample, VehicleState, fly

GRAVITY_M_S2 = 9.80665
VEHICLE_LAG_S = 0.11  # from a tilt that is asked for to a tilt that is there, beside the delay


class Geometric:
    """Position and velocity errors, and the desired acceleration, as a thrust vector."""

    name = "geometric"

    def __init__(self, stiffness_1_s2: float = 9.0, damping_1_s: float = 4.5) -> None:
        """Keep the gains."""
        self.stiffness = stiffness_1_s2
        self.damping = damping_1_s

    def start(self, state: VehicleState) -> None:
        """Nothing is kept from sample to sample."""

    def step(self, sample: ControlSample) -> AttitudeSetpoint:
        """Where the thrust must point when this setpoint acts, and how strong it must be."""
        position = np.array(sample.state.position_enu_m)
        velocity = np.array(sample.state.velocity_enu_m_s)
        # The desired position and velocity of now; the acceleration of when it will be there.
        desired = sample.reference.motion(np.array([0.0, sample.loop_delay_s + VEHICLE_LAG_S]))
        thrust = (
            desired.acceleration_enu_m_s2[1]
            + self.stiffness * (desired.position_enu_m[0] - position)
            + self.damping * (desired.velocity_enu_m_s[0] - velocity)
            + np.array([0.0, 0.0, GRAVITY_M_S2])
        )
        size = float(np.linalg.norm(thrust))
        return AttitudeSetpoint(attitude_with_z_along(thrust / size), size)


def attitude_with_z_along(up: np.ndarray) -> tuple[float, float, float, float]:
    """The shortest rotation (w, x, y, z) that turns the vertical into a unit vector, nose east."""
    w, x, y = 1.0 + up[2], -up[1], up[0]
    size = np.sqrt(w * w + x * x + y * y)
    return float(w / size), float(x / size), float(y / size), 0.0


def main() -> None:
    """Fly both, print their figures and draw their errors."""
    flights = [
        fly(trajectory=4, controller=controller, wind="fan", seed=1)
        for controller in (Geometric(), "mpc-l1")
    ]
    for flight in flights:
        print(
            f"{flight.controller}: {flight.outcome}, mean error {1e3 * flight.mean_error_m:.1f} mm,"
            f" largest {1e3 * flight.figures.max_error_m:.1f} mm"
        )

    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 3.2), layout="constrained")
    axes = figure.subplots()
    for flight in flights:
        times_s, error_m = flight.error()
        axes.plot(times_s, 1e3 * error_m, label=flight.controller)
    axes.set(xlabel="time since the trajectory began (s)", ylabel="tracking error (mm)")
    axes.legend()
    figure.savefig("own_controller.png", dpi=150)


if __name__ == "__main__":
    main()
