"""Writes docs/performance.md and docs/images/performance-*.svg from benchmarks/results/*.json.

python benchmarks/NAME.py --keep          # measures, and keeps the result
python -m tools.performance_page
python -m tools.performance_page --check  # is the page what the results make?
"""

import argparse
import sys
from pathlib import Path

from tools.performance_page.figures import write_figures
from tools.performance_page.page import page
from tools.performance_page.results import IMAGES, PAGE, RESULTS, read_results


def main() -> int:
    """Write, or check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; 1 if it would differ")
    parser.add_argument("--results", type=Path, default=RESULTS, help="folder of the JSON files")
    asked = parser.parse_args()
    results = read_results(asked.results)
    text = page(results)
    if asked.check:
        same = PAGE.exists() and PAGE.read_text(encoding="utf-8") == text
        print("the page is what the results make" if same else f"{PAGE.name} would differ")
        return 0 if same else 1
    PAGE.write_text(text, encoding="utf-8")
    for written in (PAGE, *write_figures(results, IMAGES)):
        print(written)
    return 0


if __name__ == "__main__":
    sys.exit(main())
