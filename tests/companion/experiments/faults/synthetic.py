"""A flight that keeps every promise, made up, for tests that break one at a time."""

from dataclasses import replace

import numpy as np

from companion.experiments.faults.evidence import (
    Begun,
    Evidence,
    Said,
    Sent,
    Tracked,
    TruePath,
)
from companion.experiments.faults.judging import Limits
from companion.experiments.faults.table import Promise
from companion.experiments.faults.wire_log import Commanded
from companion.mavlink.commands import CommandId

LIMITS = Limits(tilt_rad=np.radians(30.0), state_age_s=0.1)
FAULT_S = 10.0
PROMISE = Promise(
    endings=("landed",),
    completed=True,
    begins="jump",
    within_s=0.5,
    says="has jumped",
    autopilot_says="Landing",
    mean_error_mm=30.0,
    worst_error_mm=60.0,
)


def heights(times_s):
    """Up within 3 s, down from 16 s on at 0.5 m/s."""
    return np.interp(times_s, [1.0, 4.0, 16.0, 21.0], [0.0, 2.5, 2.5, 0.0])


def path(times_s, height_m, sideways_m=None, tilt_rad=0.05):
    """True motion from heights; velocities are their differences."""
    position = np.zeros((len(times_s), 3))
    position[:, 2] = height_m
    if sideways_m is not None:
        position[:, 0] = sideways_m
    velocity = np.gradient(position, times_s, axis=0)
    return TruePath(times_s, position, velocity, np.full(len(times_s), tilt_rad))


def setpoints(times_s):
    count = len(times_s)
    return Sent(
        time_s=times_s,
        finite=np.ones(count, dtype=bool),
        tilt_rad=np.full(count, 0.1),
        thrust=np.full(count, 0.5),
        rate_rad_s=np.zeros(count),
        state_age_s=np.full(count, 0.02),
    )


def evidence(**changes):
    """A flight with something else in it."""
    times_s = np.arange(0.0, 24.0, 0.01)
    ticks_s = np.arange(5.0, 16.0, 0.01)
    flown = Evidence(
        outcome="landed",
        completed=True,
        note="",
        begun=(Begun(FAULT_S, "jump", 0.3),),
        said=(
            Said(5.0, "warning", "the battery is old"),
            Said(FAULT_S + 0.2, "warning", "the estimate has jumped by 0.3 m"),
            Said(16.0, "info", "the autopilot says: Landing at current position"),
        ),
        phases=((4.0, "engage"), (5.0, "track"), (16.0, "land")),
        sent=setpoints(ticks_s),
        path=path(times_s, heights(times_s)),
        tracked=Tracked(ticks_s, np.full(len(ticks_s), 0.02), ticks_s < 15.0),
        taken_over_s=16.0,
        others_s=None,
        commands=(Commanded(0.5, CommandId.COMPONENT_ARM_DISARM, (1.0, 0.0, 0.0)),),
        armed_s=1.0,
        disarmed_s=23.0,
        ended_s=23.0,
    )
    return replace(flown, **changes)
