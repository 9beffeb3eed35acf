"""Draws the pictures of docs/how-it-works.md: ``python -m tools.docs.how_it_works``.

Flies short flights in lockstep and runs the laws by themselves, all with fixed seeds, and writes
docs/images/how-*.svg.  It takes about a minute.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from tools.docs.pictures import adaptation, constraint, delay, ladder, loop, preview

IMAGES = Path(__file__).parents[2] / "docs" / "images"
PICTURES: dict[str, Callable[[Path], list[Path]]] = {
    "loop": loop.draw,
    "l1": adaptation.draw,
    "preview": preview.draw,
    "constraint": constraint.draw,
    "delay": delay.draw,
    "ladder": ladder.draw,
}


def main() -> None:
    """Draw all of them, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", choices=[*PICTURES, []], help="by default all")
    parser.add_argument("--out", type=Path, default=IMAGES)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    for name in asked.names or PICTURES:
        for path in PICTURES[name](asked.out):
            print(f"{path}: {path.stat().st_size:,} bytes")


if __name__ == "__main__":
    main()
