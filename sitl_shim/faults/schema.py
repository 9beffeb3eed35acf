"""Fault files: what the link does to packets when, and what befalls the vehicle when."""

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from sitl_shim.data_file import DataModel, load_data_file, parse_data, resolve_data_path
from sitl_shim.wind.events import Since, Timed

_PACKAGE = Path(__file__).parents[1]

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Delay = Annotated[float, Field(ge=0.0, le=60.0)]
"""Longer ones keep more packets waiting than a computer has room for."""
Stretch = Annotated[float, Field(ge=1e-3)]
"""A random one; one has to be drawn after another until now is reached."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Step = Annotated[float, Field(ge=-1e5, le=1e5)]
Triple = tuple[Step, Step, Step]
Flavour = Literal["px4", "ardupilot"]


class Bursts(DataModel):
    """Stretches in which nothing passes, at random moments."""

    every_s: Stretch
    """Mean time from the end of one to the beginning of the next (exponential)."""
    length_s: Stretch
    """Mean length (exponential)."""


class LinkFault(DataModel):
    """What the link does to each datagram for a while; several at once act one after another."""

    way: Literal["telemetry", "setpoints", "both"] = "both"
    """`telemetry`: from the vehicle; `setpoints`: all that is sent to it."""
    from_s: NotNegative = 0.0
    """When it begins."""
    until_s: Positive | None = None
    """None: to the end."""
    since: Since = "boot"
    """What both times count from."""
    loss: Share = 0.0
    """Share of the datagrams that is lost, each by itself."""
    bursts: Bursts | None = None
    """Stretches in which nothing passes; none by default."""
    delay_s: Delay = 0.0
    """Beside the vehicle's own transport delay."""
    jitter_s: Delay = 0.0
    """The delay is drawn evenly from delay_s ± this, and is never negative."""
    keep_order: bool = True
    """A datagram that jitters waits for the one before it; false: it may overtake."""
    duplicate: Share = 0.0
    """Share of the datagrams that arrives twice."""
    reorder: Share = 0.0
    """Share of the datagrams that later ones overtake: held for `reorder_by_s`."""
    reorder_by_s: Annotated[float, Field(gt=0.0, le=60.0)] = 0.025
    """For how long an overtaken datagram is held."""
    corrupt: Share = 0.0
    """Share of the datagrams of which one to three bytes are changed."""
    bandwidth_bytes_s: Positive | None = None
    """Datagrams wait for those before them; None: no limit."""
    queue_bytes: Positive = 20_000.0
    """So much waits for the bandwidth; what comes on top is lost."""
    pause: bool = False
    """Nothing passes; what is sent meanwhile is lost."""
    babble_packets_s: Annotated[float, Field(ge=0.0, le=1e5)] = 0.0
    """Valid packets of no use that come on top, in this direction."""

    @model_validator(mode="after")
    def _a_stretch(self) -> "LinkFault":
        if self.until_s is not None and self.until_s <= self.from_s:
            raise ValueError(f"until_s must be later than from_s, which is {self.from_s:g}")
        return self


class EstimatorReset(Timed):
    """The estimate steps, and says so (its reset counter goes up), as an EKF's reset does."""

    fault: Literal["estimator_reset"]
    position_enu_m: Triple = (0.0, 0.0, 0.0)
    """By which the position steps."""
    velocity_enu_m_s: Triple = (0.0, 0.0, 0.0)
    """By which the velocity steps."""
    yaw_deg: Step = 0.0
    """Counter-clockwise."""
    announced: bool = True
    """False: the counter stays, and the step looks like motion."""


class PositionLoss(Timed):
    """The estimator has no position and no velocity for a while; attitude and rates go on."""

    fault: Literal["position_loss"]
    lasts_s: Positive = math.inf
    """From its beginning; to the end by default."""


class FrozenTelemetry(Timed):
    """The state that is sent stays as it is for a while, though the vehicle moves."""

    fault: Literal["frozen_telemetry"]
    lasts_s: Positive
    """From its beginning."""
    stamps: Literal["frozen", "running"] = "running"
    """Whether the time stamps go on."""


class ClockJump(Timed):
    """The autopilot's clock jumps, and all its stamps and its TIMESYNC with it."""

    fault: Literal["clock_jump"]
    by_s: Annotated[float, Field(ge=-1e9, le=1e9)]
    """Forward; backward if it is negative."""


class Reboot(Timed):
    """The autopilot restarts: its motors stop until it is armed again."""

    fault: Literal["reboot"]


class ModeChange(Timed):
    """Somebody else chooses a mode."""

    fault: Literal["mode"]
    mode: dict[Flavour, str]
    """Its name, by the flavour of the autopilot."""
    by: Literal["ground_station", "rc"] = "ground_station"
    """Who does it."""


class ForcedDisarm(Timed):
    """Somebody else stops the motors in flight, by force."""

    fault: Literal["disarm"]


class BatteryLow(Timed):
    """The battery reports so little that the autopilot's failsafe acts, if it is set to."""

    fault: Literal["battery"]
    remaining: Share
    """Share of its charge that it reports from then on."""


VehicleFault = (
    EstimatorReset
    | PositionLoss
    | FrozenTelemetry
    | ClockJump
    | Reboot
    | ModeChange
    | ForcedDisarm
    | BatteryLow
)


class Faults(DataModel):
    """Everything that goes wrong on purpose in a flight."""

    name: str = "faults"
    """For a person."""
    link: tuple[LinkFault, ...] = ()
    """What the link does; several at once act one after another."""
    vehicle: tuple[Annotated[VehicleFault, Field(discriminator="fault")], ...] = ()
    """What befalls the vehicle."""
    parameters: dict[Flavour, dict[str, float]] = Field(default_factory=dict)
    """Autopilot parameters that the vehicle has from the boot on, by flavour."""

    @property
    def await_setpoints(self) -> bool:
        """Whether anything counts from the first setpoints."""
        return any(fault.since == "setpoints" for fault in (*self.link, *self.vehicle))

    def parameters_of(self, flavour: str) -> dict[str, float]:
        """Autopilot parameters of a flavour; empty where nothing is said of it."""
        return next((found for name, found in self.parameters.items() if name == flavour), {})


NO_FAULTS = Faults()


def load_faults(name_or_path: str | Path) -> Faults:
    """Load faults by the name of a shipped file, from a YAML file, or from YAML text.

    Args:
        name_or_path: text that begins with ``{`` is the faults themselves (a flow mapping).

    Raises:
        DataFileError: a `ValueError` that names the file, the key and the remedy.
    """
    if isinstance(name_or_path, str) and name_or_path.lstrip().startswith("{"):
        return parse_data(name_or_path, Faults, "faults")
    installed = _PACKAGE / "_faults"
    folder = installed if installed.is_dir() else _PACKAGE.parent / "configs" / "faults"
    return load_data_file(resolve_data_path(name_or_path, folder, "faults"), Faults, "faults")
