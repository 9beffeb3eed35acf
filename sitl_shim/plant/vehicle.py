"""Vehicles as data: what a vehicle file holds, and how it is loaded."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sitl_shim.data_file import DataModel, load_data_file, resolve_data_path

GRAVITY_M_S2 = 9.80665
"""Standard gravity, as PX4 takes it (CONSTANTS_ONE_G)."""

_VEHICLES = Path(__file__).parent / "vehicles"

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Triple = tuple[float, float, float]


class Rotor(DataModel):
    """Where one rotor sits and which way it turns."""

    position_flu_m: Triple
    """Hub from the centre of mass."""
    spin: Literal["ccw", "cw"]
    """Seen from above; the reaction on the body is the other way."""


class Propulsion(DataModel):
    """From a motor's command to its rotor's thrust and torque; the same for all rotors.

    The signal s in [0, 1] follows the command with a first-order lag, and the thrust is
    ``max_thrust_n * (shape s**2 + (1 - shape) s)``: PX4's thrust curve (its THR_MDL_FAC).
    """

    max_thrust_n: Positive
    """Of one rotor, at full command and full battery."""
    thrust_shape: Fraction
    """0: thrust is linear in the signal; 1: thrust goes with its square."""
    time_constant_s: Positive
    """Of the signal's lag behind the command."""
    torque_per_thrust_m: NotNegative
    """Torque map: reaction torque about the rotor's axis, over thrust."""


class Drag(DataModel):
    """Forces and torques of the air on the vehicle, from its velocity relative to the air."""

    linear_n_s_m: tuple[NotNegative, NotNegative, NotNegative]
    """Rotor drag along each body axis (FLU), proportional to the relative velocity."""
    quadratic_n_s2_m2: NotNegative
    """Drag of the frame, times speed times velocity, the same in all directions."""
    angular_n_m_s: tuple[NotNegative, NotNegative, NotNegative]
    """Damping torque over body rate (FLU)."""


class Battery(DataModel):
    """A battery as a voltage that falls linearly with its charge, behind a resistance."""

    full_voltage_v: Positive
    empty_voltage_v: Positive
    resistance_ohm: NotNegative
    capacity_a_h: Positive
    idle_power_w: NotNegative
    """Of the avionics."""
    full_power_w: Positive
    """Of all motors together at full command; goes with the cube of the signal."""
    voltage_exponent: NotNegative
    """The signal that a command reaches goes with (voltage / full voltage) to this power:
    0 for speed-controlled motors, 1 for a plain voltage-fed motor."""

    @model_validator(mode="after")
    def _voltages_in_order(self) -> "Battery":
        if self.empty_voltage_v >= self.full_voltage_v:
            raise ValueError("empty_voltage_v must be below full_voltage_v")
        return self


class GroundContact(DataModel):
    """The landing gear: four feet in a rectangle, on ground that does not give."""

    foot_x_m: Positive
    """Feet are this far ahead of and behind the centre of mass."""
    foot_y_m: Positive
    """Feet are this far left and right of the centre of mass."""
    foot_depth_m: Positive
    """Feet are this far below the centre of mass."""
    friction: NotNegative
    """Coulomb's coefficient."""


class Spread(DataModel):
    """How far one vehicle of the type differs from the next; drawn uniformly, by seed."""

    thrust_fraction: Fraction
    """Every rotor's thrust is scaled alike, by 1 plus or minus at most this."""
    trim_deg: NotNegative
    """Roll and pitch of the attitude estimate are off by a constant of at most this."""


class VehicleModel(DataModel):
    """One vehicle: everything that makes it differ from another."""

    name: str
    mass_kg: Positive
    inertia_kg_m2: tuple[Positive, Positive, Positive]
    """About the body axes (FLU); products of inertia are zero."""
    rotors: tuple[Rotor, Rotor, Rotor, Rotor]
    """In PX4's order for a quad X: front right, rear left, front left, rear right."""
    propulsion: Propulsion
    drag: Drag
    battery: Battery
    ground_contact: GroundContact
    spread: Spread
    autopilot_parameters: dict[str, float] = Field(default_factory=dict)
    """Values of PX4 parameters that this airframe sets."""
    ardupilot_parameters: dict[str, float] = Field(default_factory=dict)
    """Values of ArduPilot parameters that this airframe sets."""
    sensor_profile: str
    """Name of the sensor profile that it flies with by default."""
    telemetry_delay_s: NotNegative
    """Transport delay of its radio link, vehicle to companion."""
    command_delay_s: NotNegative
    """Transport delay of its radio link, companion to vehicle."""

    @model_validator(mode="after")
    def _can_fly(self) -> "VehicleModel":
        weight_n = self.mass_kg * GRAVITY_M_S2
        if 4.0 * self.propulsion.max_thrust_n <= weight_n:
            raise ValueError(
                f"four rotors of {self.propulsion.max_thrust_n} N cannot lift {weight_n:.1f} N"
            )
        return self

    def parameters_of(self, autopilot: str) -> dict[str, float]:
        """Parameters that the airframe sets under a flavour."""
        ardupilot = autopilot == "ardupilot"
        return self.ardupilot_parameters if ardupilot else self.autopilot_parameters

    @property
    def hover_signal(self) -> float:
        """Signal of each rotor at which a vehicle without spread hovers in still air."""
        share = self.mass_kg * GRAVITY_M_S2 / (4.0 * self.propulsion.max_thrust_n)
        return signal_for_thrust(share, self.propulsion.thrust_shape)


def signal_for_thrust(thrust_fraction: float, shape: float) -> float:
    """The signal in [0, 1] that gives a fraction of the full thrust (the curve's inverse)."""
    if shape == 0.0:
        return thrust_fraction
    linear = 1.0 - shape
    root = (linear * linear + 4.0 * shape * thrust_fraction) ** 0.5
    return float((root - linear) / (2.0 * shape))


def load_vehicle(name_or_path: str | Path) -> VehicleModel:
    """Load a vehicle by its name (``bebop2``, ``x500``, ``sih_quadx``) or from a YAML file.

    Raises:
        DataFileError: a `ValueError` that names the file, the key and the remedy.
    """
    path = resolve_data_path(name_or_path, _VEHICLES, "vehicle")
    return load_data_file(path, VehicleModel, "vehicle")
