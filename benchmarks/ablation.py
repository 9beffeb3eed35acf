"""Flies MPC-L1+ with one part left out at a time, through `companion compare`.

    python benchmarks/ablation.py [--vehicle bebop2] [--seeds 2] [--out ablation]

Trajectories 2, 4 and 5; calm, with the fan, in gusts; and each on a vehicle that lags 50 % more.
The controllers' files are written to the folder, so that each row can be flown again.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

import yaml

from companion.config.resolve import controller_path

PARTS: dict[str, dict[str, Any]] = {
    "all of it": {},
    "σ̂ = 0": {"sigma_bound_m_s2": [0.001, 0.001, 0.001]},
    "lag not learnt": {"lag": None},
    "drag, gain, heading not learnt": {"mismatch": None},
    "no penalty on w'": {
        "rate_time_s": [0.0, 0.0, 0.0],
        "bandwidth_rad_s": [5.0, 5.0, 5.0],
        "sigma_walk": [0.3, 0.3, 0.3],
    },
    "C(s) at 5 rad/s": {"low_pass_rad_s": [5.0, 5.0, 5.0]},
}
"""What is changed in the section `plus`.  Without the penalty on w' the other two are lowered to
the same slew of the tilt command."""


def main() -> None:
    """Write the variants and compare them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--vehicle", default="bebop2")
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--against", default="truth")
    parser.add_argument("--out", type=Path, default=Path("ablation"))
    options = parser.parse_args()
    original = yaml.safe_load(controller_path("mpc-l1-plus", options.vehicle).read_text())
    options.out.mkdir(parents=True, exist_ok=True)
    controllers = []
    for number, (name, changes) in enumerate(PARTS.items()):
        variant = {**original, "plus": {**original["plus"], **changes}, "fallback": "none"}
        path = options.out / f"variant-{number}.yaml"
        path.write_text(yaml.safe_dump(variant, sort_keys=False, allow_unicode=True))
        controllers.append(f"{name}={path}")
    command = [sys.executable, "-m", "companion", "compare", *controllers]
    command += ["--vehicle", options.vehicle, "--traj", "2,4,5", "--seeds", str(options.seeds)]
    command += ["--wind", "calm", "--wind", "fan", "--wind", "gusts", "--perturb", "lag+50"]
    command += ["--against", options.against, "--set", "monitor.act=false"]
    sys.exit(subprocess.run([*command, "--out", str(options.out)], check=False).returncode)


if __name__ == "__main__":
    main()
