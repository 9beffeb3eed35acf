"""What the paper claims, sentence by sentence, and the rule that judges each.

Quotations are the paper's words, "…" where some are left out.  A judgement (`judgements.py`) is a
function of the results; nobody writes a verdict.  Where a flight that a claim rests on was lost, it
counts as not tested.
"""

from collections.abc import Callable
from dataclasses import dataclass

from companion.experiments.paper import judgements as judge
from companion.experiments.paper.judgements import Judgement, UndecidedError
from companion.experiments.paper.results import Claim, PaperResults


@dataclass(frozen=True, slots=True)
class Statement:
    """A sentence that claims something."""

    quote: str
    section: str
    rule: str
    judge: Callable[[PaperResults], Judgement]


def judge_claims(results: PaperResults) -> tuple[Claim, ...]:
    """All claims with their verdicts, in the paper's order."""
    return tuple(_judged(statement, results) for statement in STATEMENTS)


def _judged(statement: Statement, results: PaperResults) -> Claim:
    try:
        found = statement.judge(results)
    except UndecidedError as undecided:
        found = Judgement("–", "not tested", str(undecided))
    return Claim(
        statement.quote,
        statement.section,
        found.figures,
        statement.rule,
        found.verdict,
        found.reason,
    )


STATEMENTS: tuple[Statement, ...] = (
    Statement(
        "enables the system to achieve high-accuracy trajectory tracking on the first iteration",
        "I",
        "MPC-L1, calm: reproduced if the mean of the five trajectories is at most 30 mm and the "
        "worst trajectory's at most 60 mm (the vehicle is some 300 mm wide); partly up to twice "
        "that.",
        judge.high_accuracy,
    ),
    Statement(
        "As a result, arbitrarily high adaptation gains can be chosen for fast adaptation",
        "I",
        "Reproduced if every flown Γ from 300 up is stable and the noisy |ỹ| at the highest is at "
        "most a tenth above its least value; partly if all are stable.",
        judge.high_gain,
    ),
    Statement(
        "to control nonlinear systems with reduced computational cost as compared to nonlinear "
        "MPC schemes",
        "I",
        "The whole of MPC-L1 over one period against one nonlinear plan, median times: reproduced "
        "if the fastest nonlinear scheme takes at least twice as long, partly if it takes longer.",
        judge.computing,
    ),
    Statement(
        "remove the need for persistent excitation to achieve accurate adaptation",
        "I",
        "In a hover in steady wind: reproduced if the settled σ̂ is within 10 % of the wind's push "
        "over g without noise, and within 25 % with noise, its trim (σ̂ in a calm hover of the same "
        "seed) taken off; partly if only without.",
        judge.excitation,
    ),
    Statement(
        "then the closed-loop reference system … is bounded-input, bounded-output (BIBO) stable",
        "III-A",
        "Reproduced if ‖G‖ L < 1 on each axis and the simulated y1_ref of each flight stays below "
        "twice the largest r1 that drives it; not if the condition holds and it does not.",
        judge.reference_bounded,
    ),
    Statement(
        "which means that for high adaptation gains, the estimation error is bounded and can be "
        "made arbitrarily small",
        "III-A",
        "Without noise: reproduced if log max|ỹ| falls with log Γ at a slope of -0.5 or less, over "
        "the stable Γ that are sampled at 10 √(mΓ) or faster; partly if it falls at all.",
        judge.adaptation_rate,
    ),
    Statement(
        "Furthermore, the actual system output approaches the behavior of the reference system",
        "III-A",
        "Without noise: reproduced if |y1_ref - y1| stays under 0.1 m/s and under γ1 on each axis; "
        "partly under 0.2 m/s.",
        judge.reference_followed,
    ),
    Statement(
        "When the uncertainties are within the bandwidth of the low-pass filter, the controller "
        "is able to cancel the uncertainties exactly",
        "III-A",
        "A steady wind is within any bandwidth: reproduced if the noise-free hover in it settles "
        "within 1 mm of its point; partly within 10 mm.",
        judge.cancellation,
    ),
    Statement(
        "The estimation error remains bounded for the length of the trajectory",
        "IV-C",
        "Reproduced if max|ỹ| is on each axis under γ0 as it comes out with the flight's own |σ̂| "
        "and |σ̂'| without noise, and under that plus five standard deviations of what noise makes "
        "with it; partly if only without.",
        judge.bounded_estimate,
    ),
    Statement(
        "The actual system does behave close to the ideal reference system",
        "IV-C",
        "Hover, then a 3-D line of 1.87 m: reproduced if no axis is ever further than 100 mm from "
        "D(s) r2; partly up to 200 mm.",
        judge.ideal_system,
    ),
    Statement(
        "The PID- and LQR-based controllers use only feedback information to correct for tracking "
        "errors and have significantly larger tracking errors than the proposed",
        "IV-D",
        "Calm: reproduced if both are worse on every trajectory and at least 2 × in the mean; "
        "partly if they are worse in the mean.",
        judge.feedback_only,
    ),
    Statement(
        "The feedback-only controllers show a significant tracking delay",
        "IV-D",
        "Along trajectory 4: reproduced if both lag by at least 0.1 s and 3 × as much as MPC-L1; "
        "partly if both lag more than MPC-L1.",
        judge.delay,
    ),
    Statement(
        "The system model obtained through the step response experiments for the MPC-PID framework "
        "is not accurate enough to describe the system behavior well",
        "IV-E",
        "Reproduced if on an axis the model's misfit of the step is more than 10 % rms, and "
        "MPC-PID with that model is worse than MPC-L1; partly if one of the two.",
        judge.step_model,
    ),
    Statement(
        "We found that tuning this system model for each trajectory could improve performance for "
        "that trajectory; however, doing so affected the performance of the other trajectories",
        "IV-E",
        "Reproduced if tuning helps at home by 2 % or more and at least half of the foreign models "
        "are worse than the trajectory's own by 2 % or more; partly if one of the two.",
        judge.one_model,
    ),
    Statement(
        "framework is able to keep approximately the same performance when a disturbance is "
        "applied",
        "IV-E",
        "MPC-L1: reproduced if the fan costs at most a quarter more; partly if at most twice as "
        "much.",
        judge.same_with_fan,
    ),
    Statement(
        "The MPC-PID approach performs generally worse when wind is applied compared to without "
        "wind",
        "IV-E",
        "Reproduced if the fan makes it worse in the mean and on at least four of the five; partly "
        "if in the mean only.",
        judge.mpc_pid_worse_with_fan,
    ),
    Statement(
        "Only for trajectory 3, the disturbance applied to the system steers the system in the "
        "direction that reduces the tracking trajectory error",
        "IV-E",
        "Reproduced if the fan makes MPC-PID better on trajectory 3 and on no other; partly if it "
        "does so on trajectory 3. (It depends on where the fan stands, which the paper does not "
        "say.)",
        judge.only_trajectory_3,
    ),
    Statement(
        "the proposed framework has, on average, a significantly smaller increase in the error "
        "when the disturbance is applied",
        "IV-E",
        "Reproduced if MPC-L1's increase is at most half of MPC-PID's, also of the one that is "
        "tuned as a whole; partly if it is smaller than that of MPC-PID by the paper's recipe.",
        judge.smaller_increase,
    ),
    Statement(
        "the proposed method improves the tracking performance of the system as compared to "
        "non-predictive approaches … and a non-adaptive approach (MPC-PID), even in the presence "
        "of strong wind disturbances",
        "V",
        "Calm and with the fan: reproduced if MPC-L1 has a smaller mean than PID-L1, LQR-L1 and "
        "MPC-PID, also the MPC-PID that is tuned as a whole; partly if than the first three.",
        judge.better_than_all,
    ),
    Statement(
        "keep the system close to a predefined linear system behavior, despite the presence of "
        "disturbances and changing dynamics",
        "V",
        "A load of a fifth of the mass is taken up in flight: reproduced if the mean distance of "
        "y2 from D(s) r2 then settles at most a quarter above that without the load; partly up to "
        "twice.",
        judge.changing_dynamics,
    ),
)
