"""Writes docs/differences.md: how the shim answers recorded clients of real autopilots."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from tests.sitl_shim.captures.conversation import read_capture  # noqa: E402
from tests.sitl_shim.captures.replay import SETTINGS, replay  # noqa: E402
from tests.sitl_shim.captures.verdicts import page, verdicts  # noqa: E402

if __name__ == "__main__":
    words = {}
    for name in SETTINGS:
        capture = read_capture(name)
        found = verdicts(capture, replay(capture))
        words[name] = {aspect: verdict.word for aspect, verdict in found.items()}
        for aspect, verdict in found.items():
            for text in verdict.unknown:
                print(f"not listed: {name}, {aspect}: {text}")
    (ROOT / "docs" / "differences.md").write_text(page(words))
