"""What the compiler costs a run of the tests, at its end: its share of the time, and the memory.

Its parts: the front end traces a kernel in Python; LLVM makes code of it, or the cache of kernels
has it; the first launch makes it machine code and runs it once.
"""

import collections
import resource
import sys
import time

import pytest
from taichi._lib import core
from taichi.lang.kernel_impl import Kernel

_PARTS = ("front end", "LLVM", "first launch")
_spent = collections.Counter()
_fresh, _listening, _of_workers = set(), [], []
_BYTES_OF_MAXRSS = 1 if sys.platform == "darwin" else 1024


def _timed(owner, name, part):
    """Count the time of calls of a method for which ``part(arguments, before)`` names a part."""
    original = getattr(owner, name)

    def method(*arguments, **options):
        before, begun = part(arguments, None), time.perf_counter()
        result = original(*arguments, **options)
        _spent[part(arguments, before)] += time.perf_counter() - begun
        return result

    setattr(owner, name, method)


def _traced(arguments, before):
    """Of ``Kernel.materialize``: the number of compiled forms, then what its growth says."""
    kernel = arguments[0]
    # The second name is that of Quadrants.
    forms = getattr(kernel, "compiled_kernels", None) or getattr(kernel, "materialized_kernels", ())
    if before is None:
        return len(forms)
    if len(forms) == before:
        return ""
    _fresh.add(kernel)
    _spent["kernels"] += 1
    for names in _listening:
        names.append(kernel.func.__name__)
    return "front end"


def _launched(arguments, before):
    """Of ``Kernel.launch_kernel``: whether it is the first of what has been traced."""
    if before is None:
        return arguments[0] in _fresh
    _fresh.discard(arguments[0])
    return "first launch" if before else ""


_timed(Kernel, "materialize", _traced)
_timed(Kernel, "launch_kernel", _launched)
_timed(core.Program, "compile_kernel", lambda arguments, before: "LLVM")


@pytest.fixture
def compilations():
    """Names of the kernels that are compiled from here on, in their order."""
    _listening.append([])
    yield _listening[-1]
    _listening.pop()


def pytest_sessionstart(session):
    """The session's time begins."""
    _spent["begun"] = time.perf_counter()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session):
    """A worker tells the process that started it what it counted."""
    seconds = time.perf_counter() - _spent.pop("begun")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _BYTES_OF_MAXRSS
    counted = {**_spent, "seconds": seconds, "bytes": memory}
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiler"] = counted
    elif not _of_workers:
        _of_workers.append(counted)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node, error):
    """Hear of a worker that has ended well."""
    counted = getattr(node, "workeroutput", {}).get("compiler")
    if counted:
        _of_workers.append(counted)


def pytest_terminal_summary(terminalreporter):
    """One line."""
    if _of_workers:
        terminalreporter.write_line(line(_of_workers))


def line(workers):
    """What workers have counted, in words; a first launch has LLVM in it."""
    sums = collections.Counter()
    for counted in workers:
        sums.update(counted)
    sums["first launch"] -= sums["LLVM"]
    parts = ", ".join(f"{part} {sums[part]:.0f} s" for part in _PARTS)
    share = sum(sums[part] for part in _PARTS) / sums["seconds"]
    largest = max(counted["bytes"] for counted in workers) / 1e9
    return (
        f"compiler: {share:.0%} of {sums['seconds']:.0f} s in {len(workers)} processes ({parts};"
        f" {sums['kernels']} kernels); the largest process had {largest:.2f} GB"
    )
