"""Fuzzing that follows coverage, by atheris (the extra `fuzz`), with the targets' variations."""

import random
import sys
import time
from pathlib import Path

from tools.fuzz.findings import signature, write_finding
from tools.fuzz.targets import TARGETS

_SEEDS = 40
_LONGEST = 1 << 16
_INSTRUMENTED = ["companion", "sitl_shim"]


def run_guided(
    name: str, corpus: Path, out: Path, *, runs: int | None, seconds: float | None, seed: int
) -> int:
    """Fuzz until the runs or the time are over; does not return where atheris ends the process.

    Args:
        name: of the target.
        corpus: inputs that reach something new are kept here.
        out: where findings are written.
        runs: inputs.
        seconds: end after so long.
        seed: for the variations.

    Returns:
        1 if there was a finding, or no atheris.
    """
    try:
        import atheris
    except ImportError:
        print("atheris is not installed: `pip install companion[fuzz]`, or leave --guided out")
        return 1
    with atheris.instrument_imports(include=_INSTRUMENTED):
        target = TARGETS[name]()
    corpus.mkdir(parents=True, exist_ok=True)
    out.mkdir(parents=True, exist_ok=True)
    if not any(corpus.iterdir()):
        for number in range(_SEEDS):
            made = target.generate(random.Random(f"{seed}/{number}"))
            (corpus / f"seed-{number:02}").write_bytes(made[:_LONGEST])
    units = 0
    began_s = time.monotonic()

    def one(data: bytes) -> None:
        nonlocal units
        try:
            units += target.run(data)
        except Exception as error:
            path = write_finding(out, name, target, data, error)
            print(f"finding: {signature(error)}\n  {path}", flush=True)
            raise

    def vary(data: bytes, most: int, chosen: int) -> bytes:
        return target.mutate(data, random.Random(chosen))[:most]

    arguments = [sys.argv[0], f"-max_len={_LONGEST}", f"-seed={seed}", "-timeout=60"]
    if runs is not None:
        arguments.append(f"-runs={runs}")
    if seconds is not None:
        arguments.append(f"-max_total_time={round(seconds)}")
    atheris.Setup([*arguments, str(corpus)], one, custom_mutator=vary)
    atheris.Fuzz()
    print(f"{name}: {units} units in {time.monotonic() - began_s:.0f} s, no finding")
    return 0
