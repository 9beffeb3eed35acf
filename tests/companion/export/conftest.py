import json
import shutil

import pytest

from tests.flights.bench import Bench


@pytest.fixture(scope="session")
def flown_once(tmp_path_factory):
    """The folder of a short flight in lockstep; nobody writes into it."""
    return Bench(tmp_path_factory.mktemp("exported")).fly().folder


@pytest.fixture
def flight(flown_once, tmp_path):
    """A copy of it that a test may spoil."""
    return shutil.copytree(flown_once, tmp_path / "flight")


@pytest.fixture
def quiet():
    return lambda what, done, total: None


@pytest.fixture
def messages_of():
    """Reads an MCAP by the library: (schema as an object, channel, message as an object)."""
    from mcap.reader import make_reader

    def read(path):
        with path.open("rb") as file:
            for schema, channel, message in make_reader(file).iter_messages():
                yield schema, channel, message, json.loads(message.data)

    return read
