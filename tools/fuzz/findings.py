"""Findings as files: the input, trimmed, and how it is repeated."""

import hashlib
import traceback
from pathlib import Path

from tools.fuzz.target import Target, trimmed


def signature(error: BaseException) -> str:
    """What findings of one cause have in common: the kind of error, and where it came up."""
    frames = traceback.extract_tb(error.__traceback__)
    place = frames[-1] if frames else None
    where = "" if place is None else f"{Path(place.filename).name}:{place.name}"
    text = "".join(c for c in str(error)[:80] if not c.isdigit()) if _of_the_fuzzer(place) else ""
    return f"{type(error).__name__} in {where} {text}".strip()


def _of_the_fuzzer(place: traceback.FrameSummary | None) -> bool:
    """True for an assertion of a target: its text says more than its place."""
    return place is not None and "fuzz" in place.filename


def write_finding(
    folder: Path, name: str, target: Target, data: bytes, error: BaseException
) -> Path:
    """Write an input that went wrong, as small as it could be made, and what went wrong.

    Returns:
        The file with the input; beside it, ``.txt`` says the rest.
    """
    sign = signature(error)

    def fails(candidate: bytes) -> bool:
        try:
            target.run(candidate)
        except (Exception, MemoryError) as other:
            return signature(other) == sign
        return False

    small = trimmed(target, data, fails, most_runs=200) if fails(data) else data
    digest = hashlib.sha256(sign.encode()).hexdigest()[:12]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-{digest}.bin"
    path.write_bytes(small)
    told = "".join(traceback.format_exception(error))
    path.with_suffix(".txt").write_text(
        f"{sign}\n\nRepeat it: python -m tools.fuzz {name} --repeat {path}\n"
        f"{len(data)} bytes, trimmed to {len(small)}\n\n{told}",
        encoding="utf-8",
    )
    return path
