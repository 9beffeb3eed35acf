"""Verdicts that are made up, by a function that a worker can find."""

from companion.experiments.faults.curves import make_curves
from companion.experiments.faults.flying import Order, Verdict, command
from companion.experiments.faults.judging import judge
from tests.companion.experiments.faults.synthetic import LIMITS, PROMISE, evidence


def verdict(order: Order) -> Verdict:
    """Of a flight that passes; but one under ArduPilot fails, and a reboot cannot be flown."""
    if order.row.name == "reboot":
        raise ValueError("no such <fault>")
    flown = evidence(completed=order.autopilot == "px4")
    judgement = judge(PROMISE, flown, LIMITS)
    curves = make_curves(PROMISE, flown, judgement.measured.detected_after_s)
    return Verdict(
        order.row.name,
        order.autopilot,
        judgement,
        flown.outcome,
        flown.note,
        curves,
        command(order),
        None,
    )
