"""Memory of this process, as the system counts it."""

import resource
import sys


def peak_memory_mb() -> float:
    """Most memory that the process has taken so far [MB]."""
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1e6 if sys.platform == "darwin" else 1e3)
