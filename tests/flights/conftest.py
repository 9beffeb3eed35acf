"""Flights for tests."""

import pytest

from tests.flights.bench import Bench


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)
