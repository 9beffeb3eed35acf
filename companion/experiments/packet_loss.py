"""A link that loses packets at random, for flights in lockstep."""

import numpy as np

from companion.lockstep import Tap
from companion.report.flight_data import is_truth_packet

_SEED_STREAM = 71
"""Beside those of the shim, which are small numbers."""


def lossy_taps(share: float, seed: int) -> tuple[Tap, Tap]:
    """Taps that lose packets: from the vehicle, and to it.

    Each packet is lost by itself, with the same chance.  The simulation's truth is not of the link
    and passes.

    Args:
        share: of the packets that is lost, 0 to 1.
        seed: of the flight; decides which, together with the order of the packets.
    """
    from_vehicle, to_vehicle = (
        _tap(
            share, np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_SEED_STREAM, k)))
        )
        for k in range(2)
    )
    return from_vehicle, to_vehicle


def _tap(share: float, random: np.random.Generator) -> Tap:
    def tap(data: bytes) -> bytes:
        if is_truth_packet(data):
            return data
        return b"" if random.random() < share else data

    return tap
