"""What must stand before anything else of a test run is imported."""

import os

# Two processes of tests share the processors: threads of the linear algebra only get in their way.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
