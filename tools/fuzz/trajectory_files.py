"""Target: trajectory files, CSV and YAML, from bytes to positions."""

import math
import random
from pathlib import Path

import numpy as np

from companion.trajectories.feasibility import MotionLimits, problems_of
from companion.trajectories.from_file import TrajectoryFileError, load_trajectory
from tools.fuzz.scratch import scratch_folder
from tools.fuzz.target import FindingError
from tools.fuzz.texts import varied

_SUFFIXES = (".csv", ".yaml")
_WORDS = ["t", "x", "y", "z", "name", "points", "t,x,y,z"]
_FARTHEST_M = 1e5
"""A spline through points that lie awkwardly in time swings out: it cannot be flown then."""


class TrajectoryFiles:
    """See the module."""

    unit = "documents"

    def __init__(self, configs: Path) -> None:
        """Prepare.

        Args:
            configs: the shipped configurations.
        """
        folder = configs / "trajectories"
        self._shipped = [
            [path.read_text(encoding="utf-8") for path in sorted(folder.glob(f"*{suffix}"))]
            for suffix in _SUFFIXES
        ]
        self._folder = scratch_folder()

    def generate(self, rng: random.Random) -> bytes:
        """A shipped file, or made-up points, varied."""
        kind = rng.randrange(2)
        if rng.random() < 0.3:
            text = rng.choice(self._shipped[kind])
        else:
            text = _points(rng, csv=kind == 0)
        data = varied(text, rng, _WORDS).encode("utf-8", errors="surrogatepass")
        if rng.random() < 0.03:
            at = rng.randrange(len(data) + 1)
            data = data[:at] + rng.randbytes(rng.randrange(1, 4)) + data[at:]
        return bytes((kind,)) + data

    def mutate(self, data: bytes, rng: random.Random) -> bytes:
        """The same kind of file, varied once more."""
        text = data[1:].decode("utf-8", errors="replace")
        return data[:1] + varied(text, rng, _WORDS).encode("utf-8", errors="surrogatepass")

    def pieces(self, data: bytes) -> list[bytes]:
        """The kind, and lines."""
        return [data[:1], *data[1:].splitlines(keepends=True)]

    def join(self, pieces: list[bytes]) -> bytes:
        """The input of these."""
        return b"".join(pieces)

    def run(self, data: bytes) -> int:
        """Read one file, and ask it where to be."""
        kind = data[0] % 2 if data else 0
        path = self._folder / f"fuzzed{_SUFFIXES[kind]}"
        path.write_bytes(data[1:])
        try:
            trajectory = load_trajectory(path)
        except TrajectoryFileError as error:
            if str(path) not in str(error) or len(str(error)) > 100_000:
                raise FindingError(f"an error does not say where: {str(error)[:300]}") from error
            return 1
        if not 0.0 < trajectory.end_s <= 3600.0 or not math.isfinite(trajectory.end_s):
            raise FindingError(f"a trajectory takes {trajectory.end_s} s")
        times = np.linspace(-1.0, trajectory.end_s + 1.0, 64)
        motion = trajectory.motion(times)
        for array in (motion.position_m, motion.velocity_m_s, motion.acceleration_m_s2):
            if not np.isfinite(array).all():
                raise FindingError("a trajectory is not finite")
        far = np.abs(motion.position_m).max() > _FARTHEST_M
        if (
            far
            and trajectory.end_s < 100.0
            and not problems_of(trajectory, MotionLimits(50.0, 50.0))
        ):
            raise FindingError("a trajectory out of the world counts as one that can be flown")
        return 1


def _points(rng: random.Random, *, csv: bool) -> str:
    times = sorted(round(rng.uniform(0.0, rng.choice((1.0, 10.0, 4000.0))), 3)
                   for _ in range(rng.randrange(1, 12)))  # fmt: skip
    rows = [(t, *(round(rng.uniform(-9, 9), 2) for _ in range(3))) for t in times]
    if csv:
        return "t,x,y,z\n" + "".join(",".join(map(str, row)) + "\n" for row in rows)
    return "name: x\npoints:\n" + "".join(f"  - {list(row)}\n" for row in rows)
