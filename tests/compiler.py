"""What the compiler costs a run of the tests, at its end: its share of the time, and the memory."""

import collections
import resource
import sys
import time

import pytest
from taichi._lib import core
from taichi.lang.kernel_impl import Kernel

_spent = collections.Counter()
_listening, _of_workers = [], []
_BYTES_OF_MAXRSS = 1 if sys.platform == "darwin" else 1024


def _timed(owner, name, part):
    """Count the time of a method's calls; returns the method as it was."""
    original = getattr(owner, name)

    def method(*arguments, **options):
        begun = time.perf_counter()
        result = original(*arguments, **options)
        _spent[part] += time.perf_counter() - begun
        return result

    setattr(owner, name, method)
    return method


def _forms(kernel):
    # The second name is that of Quadrants.
    return getattr(kernel, "compiled_kernels", None) or getattr(kernel, "materialized_kernels", ())


def _materialize(kernel, *arguments, **options):
    """Trace a kernel where it has no such form yet, which is heard."""
    before = len(_forms(kernel))
    result = _traced(kernel, *arguments, **options)
    if len(_forms(kernel)) > before:
        _spent["kernels"] += 1
        for names in _listening:
            names.append(kernel.func.__name__)
    return result


_traced = _timed(Kernel, "materialize", "front end")
Kernel.materialize = _materialize
# LLVM makes code of what is traced, or the cache of kernels has it.
_timed(core.Program, "compile_kernel", "LLVM")


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
        of = collections.Counter()
        for counted in _of_workers:
            of.update(counted)
        largest = max(counted["bytes"] for counted in _of_workers) / 1e9
        terminalreporter.write_line(
            f"compiler: {of['kernels']} kernels, front end {of['front end']:.0f} s, LLVM"
            f" {of['LLVM']:.0f} s of {of['seconds']:.0f} s in {len(_of_workers)} processes; the"
            f" largest had {largest:.2f} GB"
        )
