"""What ArduCopter does by itself when the estimator, the battery or a fence gives cause."""

from sitl_shim.autopilot.ardupilot import ekf_check
from sitl_shim.autopilot.ardupilot.battery_watch import BatteryState, BatteryWatch
from sitl_shim.autopilot.ardupilot.commander import ACCEPTED, Commander
from sitl_shim.autopilot.ardupilot.ekf_check import EkfCheck, EkfVerdict
from sitl_shim.autopilot.ardupilot.fence import Fence, fence_names
from sitl_shim.autopilot.ardupilot.flight_control import FlightControl
from sitl_shim.autopilot.ardupilot.modes import Mode, mode_name
from sitl_shim.autopilot.interface import BatteryReport, Motion
from sitl_shim.autopilot.parameters import ParameterStore
from sitl_shim.frames import Vector3

PERIOD_US = 20_000
_FENCE_PERIOD_US = 40_000
_WARNS_EVERY_US = 30_000_000
_CRITICAL, _WARNING, _NOTICE = 2, 4, 5
_REPORT_ONLY, _ALT_HOLD, _EVEN_BY_HAND = 0, 2, 3
"""Values of FS_EKF_ACTION; any other lands."""
_GIVE_UP_M = 100.0
"""So far outside a fence it lands at once."""

_RETURN, _LAND, _BRAKE = (Mode.RTL, Mode.LAND), (Mode.LAND,), (Mode.BRAKE, Mode.LAND)
_BATTERY_MODES: dict[int, tuple[Mode, ...]] = {
    1: _LAND,
    2: _RETURN,
    3: _RETURN,
    4: _RETURN,
    6: _RETURN,
    7: _BRAKE,
}
"""By BATT_FS_*_ACT: 5 stops the motors, 0 does nothing; the way it came is straight home here."""
_TERMINATE = 5
_FENCE_MODES: dict[int, tuple[Mode, ...]] = {
    1: _RETURN,
    2: _LAND,
    3: _RETURN,
    4: _BRAKE,
    5: _RETURN,
}
"""By FENCE_ACTION; 0 only reports."""


class Guards:
    """Looks after one flight.

    Args:
        parameters: of the autopilot.
        commander: changes modes, disarms, speaks.
        control: flies.
    """

    def __init__(
        self, parameters: ParameterStore, commander: Commander, control: FlightControl
    ) -> None:
        self._parameters = parameters
        self._commander = commander
        self._control = control
        self._ekf = EkfCheck()
        self._ekf_acted = False
        self._ekf_warned_us: int | None = None
        self._battery = BatteryWatch(parameters)
        self._fence = Fence(parameters)

    def step(
        self,
        time_us: int,
        motion: Motion,
        battery: BatteryReport,
        home_enu_m: Vector3 | None,
        *,
        position_known: bool,
    ) -> None:
        """One look at everything that is due, every `PERIOD_US`."""
        if time_us % ekf_check.PERIOD_US == 0:
            self._check_ekf(time_us, position_known=position_known)
            if self._commander.armed and self._battery.look(time_us, battery):
                self._battery_is_low(battery)
            self._commander.failsafe = (
                self._ekf.failed or self._battery.state is not BatteryState.GOOD
            )
        if time_us % _FENCE_PERIOD_US == 0 and home_enu_m is not None and position_known:
            self._check_fence(motion, home_enu_m)

    # --- the estimator ---

    def _check_ekf(self, time_us: int, *, position_known: bool) -> None:
        verdict = self._ekf.look(position_known=position_known)
        if verdict is EkfVerdict.FAILED:
            since_us = self._ekf_warned_us
            if since_us is None or time_us - since_us > _WARNS_EVERY_US:
                self._ekf_warned_us = time_us
                self._commander.say(_CRITICAL, "EKF variance")
            if self._commander.armed:
                self._leave_position()
        elif verdict is EkfVerdict.CLEARED and self._ekf_acted:
            self._ekf_acted = False
            self._commander.say(_CRITICAL, "EKF Failsafe Cleared")

    def _leave_position(self) -> None:
        commander = self._commander
        action = self._parameters.integer("FS_EKF_ACTION")
        if commander.mode is Mode.LAND or action == _REPORT_ONLY:
            return  # it goes on landing, level
        if not commander.mode.needs_position and action != _EVEN_BY_HAND:
            return
        if action == _ALT_HOLD:
            commander.set_mode(Mode.ALT_HOLD)
        else:
            self._fly_one_of(_LAND, pause=True)
        self._ekf_acted = True
        name = mode_name(commander.mode)
        commander.say(_CRITICAL, f"EKF Failsafe: changed to {name} Mode")

    # --- the battery ---

    def _battery_is_low(self, report: BatteryReport) -> None:
        commander, watch = self._commander, self._battery
        level = "low" if watch.state is BatteryState.LOW else "critical"
        used_mah = watch.used_mah(report)
        commander.say(
            _WARNING, f"Battery 1 is {level} {report.voltage_v:.2f}V used {used_mah:.0f} mAh"
        )
        if self._control.landed:
            commander.say(_WARNING, "Battery Failsafe - Disarming")
            commander.disarm()
            return
        commander.say(_WARNING, "Battery Failsafe")
        action = watch.action()
        if action == _TERMINATE:
            commander.disarm()
        else:
            self._fly_one_of(_BATTERY_MODES.get(action, ()), pause=True)

    # --- the fence ---

    def _check_fence(self, motion: Motion, home_enu_m: Vector3) -> None:
        commander, guard = self._commander, self._fence
        before = guard.breached
        new = guard.look(motion.position_enu_m, home_enu_m)
        if before and not guard.breached and not self._control.landed:
            commander.say(_NOTICE, "Fence breach cleared")
        if not new or not commander.armed or self._control.landed:
            return
        commander.say(_NOTICE, f"{fence_names(new)} breached")
        action = self._parameters.integer("FENCE_ACTION")
        modes = _FENCE_MODES.get(action, ())
        if modes and guard.beyond_m > _GIVE_UP_M:
            modes = _LAND
        self._fly_one_of(modes, pause=False)

    def _fly_one_of(self, modes: tuple[Mode, ...], *, pause: bool) -> None:
        """Change to the first mode that can be entered.

        Args:
            modes: to try.
            pause: whether a landing waits for some seconds, for whoever may take over.
        """
        if self._commander.mode in modes:
            return
        for mode in modes:
            if self._commander.set_mode(mode) == ACCEPTED:
                self._control.pauses_before_landing = pause and mode is Mode.LAND
                return
