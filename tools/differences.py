"""Writes docs/differences.md: how the shim answers recorded clients of real autopilots."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.sitl_shim.captures.verdicts import page  # noqa: E402

if __name__ == "__main__":
    (ROOT / "docs" / "differences.md").write_text(page())
