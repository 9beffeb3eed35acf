"""How many packets are lost, by their numbers, and what patience that asks for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.flight.vehicle.losses import Losses
from companion.mavlink.exchange import Patience

USUAL = Patience(timeout_s=0.5, attempts=4)


def hear(losses, numbers):
    for number in numbers:
        losses.on_packet(number % 256)


def lossy(share, packets=3000, seed=1):
    kept = np.random.default_rng(seed).random(packets) >= share
    return [n for n in range(packets) if kept[n]]


def test_a_link_that_loses_nothing_asks_for_no_more_than_usual():
    losses = Losses()
    hear(losses, range(1000))
    assert losses.share == 0.0
    assert losses.patience(USUAL) == USUAL
    assert losses.packets_in_a_row(1e-5) == 1


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
def test_what_is_lost_is_measured(share):
    losses = Losses()
    hear(losses, lossy(share))
    assert losses.share == pytest.approx(share, abs=0.05)


def test_a_question_is_repeated_until_it_is_hardly_bad_luck_any_more():
    losses = Losses()
    hear(losses, lossy(0.3))
    attempts = losses.patience(USUAL).attempts
    unanswered = 1.0 - 0.7**2
    assert unanswered**attempts < 1e-3
    assert attempts < 20
    assert losses.patience(USUAL).timeout_s == USUAL.timeout_s


def test_what_is_overtaken_or_comes_twice_is_not_lost():
    losses = Losses()
    numbers = list(range(2000))
    for at in range(0, 1990, 20):
        numbers[at : at + 10] = [*numbers[at + 1 : at + 10], numbers[at]]
    hear(losses, [number for number in numbers for _ in range(2)])
    assert losses.share < 0.01


def test_a_pause_and_a_restart_are_no_losses_by_chance():
    losses = Losses()
    hear(losses, range(500))
    hear(losses, range(600, 800))
    losses.forget()
    hear(losses, range(300))
    assert losses.share == 0.0


@settings(deadline=None, derandomize=True, max_examples=50)
@given(st.lists(st.integers(0, 255), max_size=300))
def test_whatever_numbers_come_the_share_is_one_and_the_patience_finite(numbers):
    losses = Losses()
    hear(losses, numbers)
    assert 0.0 <= losses.share < 1.0
    assert 4 <= losses.patience(USUAL).attempts <= 40
    assert 1 <= losses.packets_in_a_row(1e-5) <= 40
