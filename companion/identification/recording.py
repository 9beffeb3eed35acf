"""What an identification flight leaves behind: samples of the state, and what was sent on them."""

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from companion.thrust_meaning import ThrustMeaning

Array = npt.NDArray[np.float64]
Names = npt.NDArray[np.str_]

_WIDTHS = {
    "position_enu_m": 3,
    "velocity_enu_m_s": 3,
    "attitude_flu_to_enu": 4,
    "rate_flu_rad_s": 3,
}
_NOT_ROWS = ("thrust_meaning", "autopilot", "left")
_MAY_BE_NAN = ("rate_flu_rad_s", "reported_thrust", "loop_delay_s", "received_s")


@dataclass(frozen=True, slots=True)
class Recording:
    """An identification flight; one row for each sample of the state on which a setpoint went out.

    The setpoint of row k was decided on the sample of row k, so its dead time counts from that
    row's `time_s`.  It holds until the one of row k + 1 acts.

    Raises:
        ValueError: the columns do not fit together, or time does not rise.
    """

    time_s: Array
    """(n,) the autopilot's time of the sample; strictly rising."""
    received_s: Array
    """(n,) the loop's time of its arrival."""
    loop_delay_s: Array
    """(n,) measured: from the sample's time until its setpoint acts; NaN where not known."""
    position_enu_m: Array
    """(n, 3) as reported."""
    velocity_enu_m_s: Array
    """(n, 3) as reported."""
    attitude_flu_to_enu: Array
    """(n, 4) as reported, w x y z."""
    rate_flu_rad_s: Array
    """(n, 3) as reported; NaN where not known."""
    roll_rad: Array
    """(n,) commanded, FLU."""
    pitch_rad: Array
    """(n,) commanded, FLU: positive is nose down."""
    yaw_rad: Array
    """(n,) commanded, counter-clockwise from east."""
    thrust: Array
    """(n,) the thrust field sent, 0..1."""
    reported_thrust: Array
    """(n,) thrust that the autopilot says it applies, 0..1, along the body's vertical
    (ATTITUDE_TARGET or VFR_HUD, the latest before the sample); NaN where not known.  Only read
    where the thrust field is a climb rate."""
    climb_rate_m_s: Array
    """(n,) commanded u_z, up positive, before the thrust law."""
    segment: Names
    """(n,) which part of the excitation: hover, roll, pitch, thrust, climb, swing, or another name
    for what lies between them."""
    thrust_meaning: ThrustMeaning
    """What the autopilot makes of the thrust field."""
    autopilot: str
    """px4 or ardupilot."""
    left: tuple[tuple[str, str], ...] = ()
    """Parts that were left early, or missed: name, and a sentence that tells why."""

    def __post_init__(self) -> None:
        """Refuse columns that do not fit together."""
        count = len(self.time_s)
        for field in fields(self):
            if field.name in _NOT_ROWS:
                continue
            column = getattr(self, field.name)
            width = _WIDTHS.get(field.name)
            wanted = (count,) if width is None else (count, width)
            if column.shape != wanted:
                raise ValueError(f"'{field.name}' must have shape {wanted}, not {column.shape}")
            if field.name == "segment" or field.name in _MAY_BE_NAN:
                continue
            if not np.isfinite(column).all():
                raise ValueError(f"'{field.name}' has values that are not finite")
        if not (np.diff(self.time_s) > 0.0).all():
            raise ValueError("'time_s' must rise from row to row")

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time_s)

    def rows(self, kept: npt.NDArray[np.bool_]) -> "Recording":
        """The rows where `kept` holds.

        Args:
            kept: (n,).
        """
        columns = {
            field.name: getattr(self, field.name)
            if field.name in _NOT_ROWS
            else getattr(self, field.name)[kept]
            for field in fields(self)
        }
        return Recording(**columns)
