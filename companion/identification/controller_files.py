"""Writes recommended gains as controller files, with the reasons beside them."""

import textwrap
from pathlib import Path

from companion.config.models import ControllerConfig, L1Config, MpcConfig
from companion.identification.recommend import AxisGains, Recommendation
from companion.recording.whole_file import write_whole

_WIDTH = 98


def mpc_l1_yaml(recommendation: Recommendation, name: str) -> str:
    """The text of `mpc-l1`'s file.

    Args:
        recommendation: what it states.
        name: of the vehicle.
    """
    controller = recommendation.controller
    l1, mpc = controller.l1, controller.mpc
    assert l1 is not None
    assert mpc is not None
    lines = [
        f"# MPC-L1 for the {name}, derived from its dynamics.",
        f"framework: {controller.framework}",
        "source: >-",
        *_folded(controller.source),
        *_remarks("Mean tracking error on test trajectories 1 to 5 in the linear model of x and y:"
                  f" {_errors(recommendation.horizontal)}."),
        "l1:",
        *_l1(l1, recommendation),
        "mpc:",
        *_mpc(mpc),
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def write_mpc_l1(recommendation: Recommendation, name: str, path: Path) -> None:
    """Write `mpc-l1`'s file; arguments as for `mpc_l1_yaml`.

    Raises:
        OSError: it can't be written.
    """
    write_whole(path, mpc_l1_yaml(recommendation, name))


def mpc_l1_plus_yaml(controller: ControllerConfig, name: str) -> str:
    """The text of `mpc-l1-plus`'s file.

    Args:
        controller: by `recommend_plus`.
        name: of the vehicle.
    """
    plus = controller.plus
    assert plus is not None
    lines = [
        f"# MPC-L1+ for the {name}: bandwidths by its lags.  Its model is in the vehicle's file.",
        f"framework: {controller.framework}",
        "source: >-",
        *_folded(controller.source),
    ]
    if controller.fallback is not None:
        lines.append(f"fallback: {controller.fallback}")
    lines += [
        "plus:",
        f"  bandwidth_rad_s: {_list(plus.bandwidth_rad_s)}",
        f"  rate_time_s: {_list(plus.rate_time_s)}",
        f"  low_pass_rad_s: {_list(plus.low_pass_rad_s)}",
        f"  sigma_walk: {_list(plus.sigma_walk)}",
    ]
    if plus.climb_rate is not None:
        values = plus.climb_rate.model_dump()
        lines += [
            "  # z over an autopilot's own climb-rate loop.",
            "  climb_rate: {" + ", ".join(f"{k}: {v:g}" for k, v in values.items()) + "}",
        ]
    return "\n".join(lines) + "\n"


def write_mpc_l1_plus(controller: ControllerConfig, name: str, path: Path) -> None:
    """Write `mpc-l1-plus`'s file; arguments as for `mpc_l1_plus_yaml`.

    Raises:
        OSError: it can't be written.
    """
    write_whole(path, mpc_l1_plus_yaml(controller, name))


def _l1(l1: L1Config, recommendation: Recommendation) -> list[str]:
    assert l1.m is not None
    assert l1.omega is not None
    lines = [
        f"  m: {_list(l1.m)}",
        f"  omega: {_list(l1.omega)}",
        f"  k: {_list(l1.k)}",
        f"  gamma: {_list(l1.gamma)}",
        "  # Covers y1 + y1'/m - u at full tilt in the worst wind, and what noise adds to it.",
        f"  sigma_bound: {_list(l1.sigma_bound)}",
    ]
    z = l1.climb_rate
    if z is None:
        return lines
    values = ", ".join(f"{key}: {value:g}" for key, value in z.model_dump().items())
    return [
        *lines,
        *_remarks(
            "z over an autopilot's own climb-rate loop (ArduCopter's default gains); in the "
            f"linear model: {_errors(recommendation.climb_rate)}.",
            "  ",
        ),
        f"  climb_rate: {{{values}}}",
    ]


def _mpc(mpc: MpcConfig) -> list[str]:
    return [
        f"  period_s: {mpc.period_s:g}",
        f"  horizon: {mpc.horizon}",
        "  # What trajectories and noise ask for, with room: an active bound is a slower MPC.",
        f"  r_max_m_s2: {mpc.r_max_m_s2:g}",
    ]


def _errors(gains: AxisGains) -> str:
    return ", ".join(f"{name} {error:.0f} mm" for name, error in gains.errors_mm)


def _list(values: tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{value:g}" for value in values) + "]"


def _remarks(text: str, indent: str = "") -> list[str]:
    return textwrap.wrap(
        text,
        _WIDTH,
        initial_indent=f"{indent}# ",
        subsequent_indent=f"{indent}# ",
        break_on_hyphens=False,
    )


def _folded(text: str) -> list[str]:
    return textwrap.wrap(
        text, _WIDTH, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False
    )
