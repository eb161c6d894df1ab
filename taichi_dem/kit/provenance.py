"""Origin of a computed number: processor, machine, memory, and commit of the sources."""

import functools
import os
import platform
import subprocess
import sys

_HERE = os.path.dirname(os.path.abspath(__file__))
#: Stands for a commit that is not known.
UNKNOWN = "unknown"


def processor() -> str:
    """Name of the processor, as the system gives it."""
    try:
        with open("/proc/cpuinfo") as lines:
            names = [line.split(":", 1)[1].strip() for line in lines if "model name" in line]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


@functools.cache
def machine() -> str:
    """Name of this machine in its network, and of its processor."""
    return f"{platform.node() or UNKNOWN}, {processor()}"


def git(*arguments: str) -> str:
    """What git says of the folder of the sources, "" where it knows nothing."""
    try:
        line = ["git", "-C", _HERE, *arguments]
        return subprocess.run(line, capture_output=True, text=True).stdout.strip()
    except OSError:
        return ""


@functools.cache
def commit() -> str:
    """Short name of the commit of the sources, "unknown" where they are in no repository."""
    # An installed package may lie in somebody's repository that does not track it.
    tracked = git("ls-files", "--", os.path.basename(__file__))
    return (git("rev-parse", "--short", "HEAD") if tracked else "") or UNKNOWN


def peak_memory_mb() -> float:
    """Most memory that the process has taken so far [MB]."""
    import resource

    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return size / (1e6 if sys.platform == "darwin" else 1e3)
