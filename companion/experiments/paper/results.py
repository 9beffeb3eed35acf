"""All that the study found, and what is judged of it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from companion.experiments.computing_time import ComputingTime
from companion.experiments.identify_steps import SecondOrder
from companion.experiments.paper.adaptation_rate import AdaptationRate
from companion.experiments.paper.bounds import BoundsFlight
from companion.experiments.paper.changing_dynamics import ChangingDynamics
from companion.experiments.paper.guarantees import Guarantees
from companion.experiments.paper.model_transfer import ModelTransfer
from companion.experiments.paper.origin import CostFigures
from companion.experiments.paper.scale import Scale
from companion.experiments.paper.tracking import Tracking
from companion.report.flight_data import Array

Verdict = Literal["reproduced", "partly", "not reproduced", "not tested"]


@dataclass(frozen=True, slots=True)
class ReferenceComparison:
    """y1 of a flight against the closed-loop reference system's under the same r1."""

    name: str
    """Of the flight, for a person."""
    times_s: Array
    y1_m_s: Array
    """(samples, 3), true."""
    y1_ref_m_s: Array
    r1_m_s: Array
    largest_m_s: Array
    """(3,) max |y1_ref - y1|."""
    rms_m_s: Array
    """(3,)"""


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where the figures come from."""

    version: str
    commit: str
    """Of the checkout; empty outside one."""
    machine: str
    python: str
    date: str
    """UTC."""
    command: str
    flights: int
    lost: int
    wall_s: float


@dataclass(frozen=True, slots=True)
class PaperResults:
    """The study."""

    scale: Scale
    tracking: Tracking
    bounds: dict[str, BoundsFlight]
    """By sensors: "exact" and "noisy"."""
    guarantees: Guarantees
    adaptation_rate: AdaptationRate
    reference: tuple[ReferenceComparison, ...]
    model_transfer: ModelTransfer
    changing_dynamics: ChangingDynamics
    origin: dict[str, CostFigures]
    """By cost: "r_minus_target" (the default) and "absolute_r" (the paper's letter)."""
    identification: tuple[SecondOrder, ...]
    """Of MPC-PID's vehicle under its PID, per axis; empty if no step could be flown."""
    computing_time: ComputingTime | None
    """None without the extra `nonlinear`."""
    provenance: Provenance


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence of the paper and what became of it."""

    quote: str
    section: str
    figures: str
    """What was measured."""
    rule: str
    """What decides the verdict."""
    verdict: Verdict
    reason: str


def by_axis(values: Array) -> dict[str, float]:
    """A vector by its axes' names."""
    return {axis: float(value) for axis, value in zip("xyz", np.asarray(values), strict=True)}
