"""The kept results of the benchmarks, and where they came from."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"
PAGE = ROOT / "docs" / "performance.md"
IMAGES = ROOT / "docs" / "images"


@dataclass(frozen=True, slots=True)
class Result:
    """What one benchmark has kept."""

    name: str
    date: str
    commit: str
    """With a + where the checkout differed from it."""
    command: str
    machine: dict[str, Any]
    figures: dict[str, Any]

    @property
    def digest(self) -> str:
        """Of the figures: a picture carries that of what it shows."""
        text = json.dumps(self.figures, sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()[:16]


def read_results(folder: Path) -> dict[str, Result]:
    """All kept results by the benchmark's name.

    Raises:
        ValueError: a file is no benchmark's result.
    """
    found = {}
    for file in sorted(folder.glob("*.json")):
        kept = json.loads(file.read_text(encoding="utf-8"))
        try:
            found[file.stem] = Result(
                kept["benchmark"],
                kept["date"],
                kept["commit"],
                kept["command"],
                kept["machine"],
                kept["results"],
            )
        except (KeyError, TypeError) as error:
            raise ValueError(f"{file} is no benchmark's result: {error} is missing") from error
    return found
