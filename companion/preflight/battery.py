"""Whether the battery is known, and lasts."""

import math

from companion.preflight.facts import BatteryFacts, Plan
from companion.preflight.finding import Finding, Verdict


def judge_battery(battery: BatteryFacts, plan: Plan) -> list[Finding]:
    """One finding."""
    voltage = "" if math.isnan(battery.voltage_v) else f", {battery.voltage_v:.1f} V"
    if math.isnan(battery.remaining):
        return [
            Finding(
                "battery",
                f"level not reported{voltage}",
                Verdict.WARNING,
                "Set up the autopilot's battery monitor: its failsafe knows no level either.",
            )
        ]
    found = f"{battery.remaining:.0%} left{voltage}"
    if battery.remaining < plan.battery_refuse_below:
        return [
            Finding(
                "battery",
                found,
                Verdict.REFUSAL,
                f"Charge it: under {plan.battery_refuse_below:.0%} no flight is begun "
                "(preflight.battery_refuse_below).",
            )
        ]
    if battery.remaining < plan.battery_warn_below:
        return [
            Finding(
                "battery",
                found,
                Verdict.WARNING,
                "Charge it, or make the flight short: the autopilot's battery failsafe would "
                "take the vehicle over.",
            )
        ]
    return [Finding("battery", found)]
