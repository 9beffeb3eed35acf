"""What must stand before anything else of a test run is imported, and the order of the tests."""

import contextlib
import os
import signal

# Processes of tests share the processors: threads of the linear algebra only get in their way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A shell's background job ignores Ctrl-C, and so would every program that a test ends by it.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

_GIVES_WAY = 10


def _flies_on_the_wall_clock(item):
    return item.get_closest_marker("realtime") is not None


def pytest_collection_modifyitems(items):
    """Flights on the wall clock first: while one process waits for them, the others compute."""
    items.sort(key=lambda item: not _flies_on_the_wall_clock(item))


def pytest_runtest_setup(item):
    """A process of several that computes gives way to the one that flies.

    One that has computed and flies next takes its place back, where it may (root).
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        wanted = 0 if _flies_on_the_wall_clock(item) else _GIVES_WAY
        with contextlib.suppress(PermissionError):
            os.nice(wanted - os.nice(0))
