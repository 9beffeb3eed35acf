"""What must stand before anything else of a test run is imported, and the order of the tests."""

import os

# Processes of tests share the processors: threads of the linear algebra only get in their way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_FLIES_FIRST = "gw0"
"""The worker process that gets the first tests."""


def pytest_configure():
    """What only computes gives way to flights on the wall clock, which are woken in time."""
    if os.environ.get("PYTEST_XDIST_WORKER", _FLIES_FIRST) != _FLIES_FIRST:
        os.nice(10)


def pytest_collection_modifyitems(items):
    """Flights on the wall clock first: while one process waits for them, the others compute."""
    items.sort(key=lambda item: item.get_closest_marker("realtime") is None)
