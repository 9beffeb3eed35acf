"""What the theory says of the shipped L1 controller on the vehicle that is flown."""

from dataclasses import dataclass

import numpy as np

from companion.config.resolve import FlightConfig
from companion.config.yaml_source import ConfigError
from companion.control.l1_adaptive import L1Gains
from companion.experiments.certified import certificate_subject
from companion.experiments.paper.scale import VELOCITY_NOISE_M_S
from companion.flight.assemble import l1_gains
from companion.report.flight_data import Array
from companion.theory.certificate import Certificate, certify
from companion.theory.envelope import Air
from companion.theory.plant import AxisPlant, axis_plants

_STANDARD_DEVIATIONS = 5.0


@dataclass(frozen=True, slots=True)
class Guarantees:
    """What the theory says of the shipped L1 controller on the vehicle; arrays are (3,)."""

    norm_g: Array
    """‖G‖_L1."""
    lipschitz: Array
    """The drag's Lipschitz constant L, in the unit of u per m/s."""
    gamma_0_m_s: Array
    """Bound of |ỹ|."""
    gamma_1_m_s: Array
    """Bound of |y1_ref - y1|."""
    noise_extra_m_s: Array
    """What measurement noise adds to |ỹ|: five standard deviations of what the sampled loop makes
    of it. Gaussian noise has no bound; this is an estimate."""
    delta: Array
    """Bound of |σ| that γ0 reckons with, in the unit of u."""
    delta_d: Array
    """Bound of |σ̇|, per second."""


@dataclass(frozen=True, slots=True)
class Theory:
    """Of the vehicle and the controller."""

    certificate: Certificate
    guarantees: Guarantees
    gains: L1Gains
    plants: tuple[AxisPlant, AxisPlant, AxisPlant]
    """A(s) of x, y and z."""
    loop_delay_s: float
    quadratic_drag_1_m: float


def theory_of(config: FlightConfig) -> Theory:
    """Certify and collect.

    Raises:
        ConfigError: the vehicle's file states no dynamics, or the controller has no L1.
    """
    dynamics, l1 = config.vehicle.dynamics, config.controller.l1
    if dynamics is None or l1 is None:
        raise ConfigError("the study needs the vehicle's `dynamics` and the controller's `l1`.")
    certificate = certify(certificate_subject(config, Air().wind_m_s))
    axes = certificate.axes

    def vector(values: list[float | None]) -> np.ndarray:
        return np.array([np.inf if value is None else value for value in values], dtype=float)

    guarantees = Guarantees(
        norm_g=vector([None if a.norm_g is None else a.norm_g.value for a in axes]),
        lipschitz=vector([a.bounds.sigma.lipschitz for a in axes]),
        gamma_0_m_s=vector([a.bounds.gamma_0_m_s for a in axes]),
        gamma_1_m_s=vector([a.bounds.gamma_1_m_s for a in axes]),
        noise_extra_m_s=_STANDARD_DEVIATIONS
        * VELOCITY_NOISE_M_S
        * vector([a.noise_to_y_tilde for a in axes]),
        delta=vector([a.bounds.delta for a in axes]),
        delta_d=vector([a.bounds.sigma.sigma_rate for a in axes]),
    )
    return Theory(
        certificate,
        guarantees,
        l1_gains(l1),
        axis_plants(dynamics),
        dynamics.loop_delay_s,
        dynamics.quadratic_drag_1_m,
    )
