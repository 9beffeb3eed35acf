"""Results of a study that nobody flew: of the right shapes and sizes, and with losses on demand."""

import math
from dataclasses import replace

import numpy as np

from companion.experiments.computing_time import WHAT, ComputingTime, MethodTime
from companion.experiments.identify_steps import SecondOrder
from companion.experiments.paper.adaptation_rate import AdaptationRate
from companion.experiments.paper.bounds import BoundsFlight
from companion.experiments.paper.changing_dynamics import (
    ChangingDynamics,
    HoverConvergence,
    LoadStep,
)
from companion.experiments.paper.guarantees import Guarantees
from companion.experiments.paper.model_transfer import ModelTransfer
from companion.experiments.paper.origin import CostFigures
from companion.experiments.paper.results import (
    Claim,
    PaperResults,
    Provenance,
    ReferenceComparison,
)
from companion.experiments.paper.scale import QUICK, TRAJECTORIES, Scale
from companion.experiments.paper.statistics import Spread, spread
from companion.experiments.paper.tracking import (
    CONTROLLERS,
    VARIANTS,
    WINDS,
    Errors,
    TimeResponse,
    Tracking,
)
from companion.trajectories.harmonic import TEST_TRAJECTORIES

_MEAN_M = {
    "pid-l1": 0.25,
    "lqr-l1": 0.34,
    "mpc-l1": 0.022,
    "mpc-pid": 0.045,
    "pid-l1-error": 0.3,
    "mpc-pid-joint": 0.03,
}
_LAG_S = {"pid-l1": 0.3, "lqr-l1": 0.4, "mpc-l1": 0.02, "mpc-pid": 0.03}
_FAN_M = 0.01


def make_results(scale: Scale = QUICK, seed: int = 0) -> PaperResults:
    """A study in which everything was flown."""
    noise = np.random.default_rng(np.random.SeedSequence(seed))
    return PaperResults(
        scale=scale,
        tracking=_tracking(scale, noise),
        bounds={"exact": _bounds(noise, 0.0), "noisy": _bounds(noise, 0.015)},
        guarantees=Guarantees(
            norm_g=np.array([4.4, 4.4, 0.7]),
            lipschitz=np.array([0.04, 0.04, 0.01]),
            gamma_0_m_s=np.array([0.9, 0.9, 1.3]),
            gamma_1_m_s=np.array([2.1, 2.1, 1.9]),
            noise_extra_m_s=np.full(3, 0.045),
            delta=np.array([16.0, 16.0, 8.0]),
            delta_d=np.array([20.0, 20.0, 9.0]),
        ),
        adaptation_rate=_adaptation_rate(scale),
        reference=(
            _reference(noise, "l1, hover and a 3-D line"),
            _reference(noise, "mpc-l1, trajectory 4"),
        ),
        model_transfer=_model_transfer(scale, noise),
        changing_dynamics=ChangingDynamics(
            {"mpc-l1": _load(scale, noise, 0.02), "mpc-pid": _load(scale, noise, 0.05)},
            _hover(noise),
        ),
        origin={
            "r_minus_target": CostFigures(0.0207, 0.02075, 0.0046),
            "absolute_r": CostFigures(0.0127, 0.0303, 0.0282),
        },
        identification=tuple(SecondOrder(4.0, 0.13, 0.05, 0.3) for _ in "xyz"),
        computing_time=_computing_time(scale),
        provenance=Provenance(
            version="0.1.0",
            commit="0123456789-dirty",
            machine="x86_64, 2 processors, Linux",
            python="3.11.2",
            date="2030-01-02 03:04 UTC",
            command="companion paper --quick --out study",
            flights=137,
            lost=0,
            wall_s=71.3,
        ),
    )


def make_claims() -> tuple[Claim, ...]:
    """One claim of each verdict, with what must be escaped in HTML."""
    verdicts = ("reproduced", "partly", "not reproduced", "not tested")
    return tuple(
        Claim(
            quote=f"Claim {k}: ỹ < γ0 & <b>bounded</b>",
            section="IV-C",
            figures=f"figure {k}: 1 < 2",
            rule=f"rule {k}",
            verdict=verdict,
            reason=f"reason {k}",
        )
        for k, verdict in enumerate(verdicts)
    )


def with_losses(results: PaperResults) -> PaperResults:
    """Everything that can be lost is: one trajectory of each controller, and whole experiments."""
    lost = [math.inf] * len(results.scale.seeds)
    errors = {
        controller: {
            wind: Errors(of_wind.by_trajectory | {5: spread(lost)}, spread(lost), spread(lost))
            for wind, of_wind in by_wind.items()
        }
        for controller, by_wind in results.tracking.errors.items()
    }
    table = results.model_transfer
    models = table.errors_m.copy()
    models[0, 4] = math.inf
    exact = results.adaptation_rate.exact_m_s.copy()
    exact[0] = math.inf
    stable = results.adaptation_rate.stable.copy()
    stable[0] = False
    nan3 = np.full(3, np.inf)
    return replace(
        results,
        tracking=Tracking(errors, {}, math.nan),
        bounds={},
        guarantees=replace(results.guarantees, gamma_0_m_s=nan3, gamma_1_m_s=nan3),
        adaptation_rate=replace(
            results.adaptation_rate,
            exact_m_s=exact,
            stable=stable,
            fitted=np.zeros(len(stable), dtype=bool),
            slope=math.nan,
            slope_all=math.nan,
            noise_decides_from=math.inf,
            well_sampled_to=math.nan,
        ),
        reference=(),
        model_transfer=ModelTransfer(models, (*table.identified[:4], spread(lost))),
        changing_dynamics=ChangingDynamics({}, None),
        origin={
            "r_minus_target": CostFigures(0.02, math.inf, math.inf),
            "absolute_r": CostFigures(math.inf, math.inf, math.inf),
        },
        computing_time=None,
    )


def _spread(mean: float, scale: Scale, noise: np.random.Generator) -> Spread:
    return spread([float(v) for v in mean * (1.0 + 0.05 * noise.standard_normal(len(scale.seeds)))])


def _tracking(scale: Scale, noise: np.random.Generator) -> Tracking:
    errors: dict[str, dict[str, Errors]] = {}
    for controller in (*CONTROLLERS, *VARIANTS):
        errors[controller] = {}
        for wind in WINDS:
            by_trajectory = {
                n: _spread(
                    _MEAN_M[controller] * (0.4 + 0.2 * n) + _FAN_M * (wind == "fan"), scale, noise
                )
                for n in TRAJECTORIES
            }
            seeds = zip(*(s.values for s in by_trajectory.values()), strict=True)
            errors[controller][wind] = Errors(
                by_trajectory,
                spread([float(np.mean(values)) for values in seeds]),
                spread([0.4] * len(scale.seeds)),
            )
    times = np.arange(0.0, 20.0, 0.01)
    desired = TEST_TRAJECTORIES[4].position(times)
    responses = {
        name: TimeResponse(
            times, desired, TEST_TRAJECTORIES[4].position(np.maximum(times - lag, 0.0)), lag
        )
        for name, lag in _LAG_S.items()
    }
    return Tracking(errors, responses, 1.46)


def _bounds(noise: np.random.Generator, deviation: float) -> BoundsFlight:
    times = np.arange(0.0, 16.5, 0.01)
    ramp = np.clip((times - 1.5) / 3.0, 0.0, 1.0)
    ideal = np.outer(ramp**2 * (3.0 - 2.0 * ramp), [1.5, 1.0, 0.5])
    position = ideal + 0.03 * np.sin(times)[:, None]
    y_tilde = 0.02 * np.exp(-((times - 3.0) ** 2))[:, None] * [1.0, -0.8, 0.1]
    y_tilde = y_tilde + deviation * noise.standard_normal((len(times), 3))
    distance = np.abs(position - ideal)
    return BoundsFlight(
        times,
        y_tilde,
        np.outer(ramp, [1.5, 1.0, 0.5]),
        position,
        ideal,
        np.abs(y_tilde).max(axis=0),
        distance.max(axis=0),
        float(np.linalg.norm(distance, axis=1).mean()),
        own_gamma_0_m_s=np.array([0.3, 0.3, 0.2]),
    )


def _adaptation_rate(scale: Scale) -> AdaptationRate:
    gammas = np.array(scale.adaptation_rates)
    exact = np.outer(0.05 * (gammas / 200.0) ** -0.9, [1.0, 0.9, 0.1])
    exact[0] *= 14.0
    noisy = np.sqrt(exact**2 + (0.04 * (gammas[:, None] / 500.0) ** 0.2) ** 2)
    return AdaptationRate(
        gammas,
        exact,
        noisy,
        stable=np.array([g > 100.0 for g in gammas]),
        fitted=np.array([100.0 < g <= 1000.0 for g in gammas]),
        slope=-0.9,
        slope_all=-1.3,
        noise_decides_from=500.0,
        noise_floor_m_s=float(noisy[:, :2].max(axis=1).min()),
        well_sampled_to=1000.0,
        step_model_m_s=0.3 * (gammas / 200.0) ** -0.5,
        step_model_slope=-0.5,
    )


def _reference(noise: np.random.Generator, name: str) -> ReferenceComparison:
    times = np.arange(-4.0, 22.0, 0.01)
    y1 = np.stack([np.sin(times), np.cos(times), 0.3 * np.sin(2.0 * times)], axis=1)
    difference = 0.02 * np.sin(3.0 * times + noise.uniform(0.0, 6.0))[:, None] * [1.0, 1.2, 0.3]
    return ReferenceComparison(
        name,
        times,
        y1,
        y1 - difference,
        1.4 * y1,
        np.abs(difference).max(axis=0),
        np.sqrt((difference**2).mean(axis=0)),
    )


def _model_transfer(scale: Scale, noise: np.random.Generator) -> ModelTransfer:
    errors = 0.05 * (1.0 + 0.5 * noise.random((5, 5)))
    errors[np.diag_indices(5)] = 0.04
    return ModelTransfer(errors, tuple(_spread(0.045, scale, noise) for _ in TRAJECTORIES))


def _load(scale: Scale, noise: np.random.Generator, size_m: float) -> LoadStep:
    times = np.arange(0.0, 20.0, 0.01)
    since = np.maximum(times - 5.0, 0.0)
    return LoadStep(
        _spread(3.0 * size_m, scale, noise),
        _spread(1.1 * size_m, scale, noise),
        _spread(size_m, scale, noise),
        _spread(0.04, scale, noise),
        _spread(0.04, scale, noise),
        largest_sag_m=5.0 * size_m,
        times_s=times,
        height_error_m=-10.0 * size_m * since * np.exp(-2.0 * since)
        + 0.001 * noise.standard_normal(len(times)),
        sigma_hat_z=-0.3 * (1.0 - np.exp(-since)) if size_m < 0.03 else np.full(len(times), np.nan),
    )


def _hover(noise: np.random.Generator) -> HoverConvergence:
    times = np.arange(0.0, 26.0, 0.01)
    sigma = np.outer(1.0 - np.exp(-times / 2.0), [0.06, 0.02, 0.0])
    noisy = sigma + 0.03 * noise.standard_normal(sigma.shape)
    return HoverConvergence(
        expected_sine=0.0635,
        settled_sine=0.0632,
        settled_noisy_sine=0.0630,
        settled_offset_m=0.0004,
        settling_s=4.6,
        times_s=times,
        sigma_hat=sigma,
        noisy_times_s=times,
        noisy_sigma_hat=noisy,
        largest_speed_m_s=0.0004,
    )


def _computing_time(scale: Scale) -> ComputingTime:
    medians = dict(zip(WHAT, (45.0, 400.0, 130.0, 14000.0, 3800.0, 900.0), strict=True))
    return ComputingTime(
        ticks=scale.mpc_ticks,
        seed=1,
        trajectory=4,
        flown_s=0.03 * scale.mpc_ticks,
        horizon=33,
        period_s=0.03,
        casadi_version="3.8.0",
        quadratic_solver="osqp",
        methods=tuple(
            MethodTime(
                name, WHAT[name], scale.mpc_ticks, us, 1.6 * us, 3.0 * us, us / 45.0, 2.0, 1.0, 0.02
            )
            for name, us in medians.items()
        ),
    )
