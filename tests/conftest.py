"""What must stand before anything else of a test run is imported, and the order of the tests."""

import os

# Processes of tests share the processors: threads of the linear algebra only get in their way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(items):
    """Flights on the wall clock first: while one process waits for them, the others compute."""
    items.sort(key=lambda item: item.get_closest_marker("realtime") is None)
