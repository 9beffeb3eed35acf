"""Flights for tests."""

import pytest

from tests.flights.bench import Bench
from tests.flights.process_flight import Flight


@pytest.fixture
def bench(tmp_path):
    return Bench(tmp_path)


@pytest.fixture
def start(tmp_path):
    """Starts flights as processes, and ends what is left of them."""
    flights = []

    def start_flight(*options):
        flights.append(Flight(tmp_path, *options))
        return flights[-1]

    yield start_flight
    for flight in flights:
        if flight.process.poll() is None:
            flight.process.kill()
        flight.process.communicate()
