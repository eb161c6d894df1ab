"""What the compiler costs a run of the tests: kernels by structure, its share of the time, memory.

The run fails where it compiles more than ``MOST_KERNELS``.
"""

import collections
import os
import resource
import sys
import time

import pytest
from taichi._lib import core
from taichi.lang.kernel_impl import Kernel

from taichi_dem.kit.engine_pool import Engine
from taichi_dem.kit.taichi_patches.names import are_on
from tests.structures import name_of

#: Kernels beyond which a run of ``make test`` fails: each costs every later run its time. It
#: compiled some 600 in November 2026; 550 are wanted.
MOST_KERNELS = 650
_spent = collections.Counter()
#: Kernels by structure, engines by structure and capacity; whose engine was made last.
_of_structure, _engines, _now = collections.Counter(), collections.Counter(), ["none"]
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
        _of_structure[_now[0]] += 1
        # Taichi's own read and write fields, where ``addresses`` is off or there is a device.
        for names in _listening if not kernel.func.__module__.startswith("taichi.") else ():
            names.append(kernel.func.__name__)
    return result


_traced = _timed(Kernel, "materialize", "front end")
Kernel.materialize = _materialize
# LLVM makes code of what is traced, or the session's folder of kernels has it.
_timed(core.Program, "compile_kernel", "LLVM")


_made = Engine.__init__


def _make(engine, structure, capacity):
    """Make an engine; kernels compiled from here on are its structure's."""
    _now[0] = name_of(structure)
    _engines[hash(structure), tuple(capacity)] += 1
    _made(engine, structure, capacity)


Engine.__init__ = _make


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
    """A worker tells the process that started it what it counted; too many kernels fail."""
    seconds = time.perf_counter() - _spent.pop("begun")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * _BYTES_OF_MAXRSS
    counted = {**_spent, "seconds": seconds, "bytes": memory, "structures": dict(_of_structure)}
    # With that of processes that tests have started.
    counted["cpu"] = sum(os.times()[:4])
    counted["engines"] = sum(_engines.values())
    counted["again"] = counted["engines"] - len(_engines)
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["compiler"] = counted
    elif not _of_workers:
        _of_workers.append(counted)
    if _too_many(_sum("kernels"), session.config) and not session.exitstatus:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _too_many(kernels, config):
    """Whether a run of the tests that a change must pass compiled more than it may."""
    # Without patches Taichi compiles a kernel for each field that is read.
    return are_on() and kernels > MOST_KERNELS and "not long" in config.option.markexpr


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node, error):
    """Hear of a worker that has ended well."""
    counted = getattr(node, "workeroutput", {}).get("compiler")
    if counted:
        _of_workers.append(counted)


def _sum(name):
    return sum(counted.get(name, 0) for counted in _of_workers)


def _loop_seconds():
    """CPU time of a fixed loop in Python [s], by which machines compare."""
    begun = time.process_time()
    for _ in range(20_000_000):
        pass
    return time.process_time() - begun


def pytest_terminal_summary(terminalreporter, config):
    """The structures that took most kernels, then a line about all."""
    if not _of_workers:
        return
    say, structures = terminalreporter.write_line, collections.Counter()
    for counted in _of_workers:
        structures.update(counted["structures"])
    for name, kernels in structures.most_common(40):
        say(f"{kernels:5d} kernels: {name}")
    say(
        f"compiler: {_sum('kernels')} kernels in {len(structures)} structures, {_sum('engines')}"
        f" engines ({_sum('again')} made again); front end {_sum('front end'):.0f} s, LLVM"
        f" {_sum('LLVM'):.0f} s of {_sum('seconds'):.0f} s in {len(_of_workers)} processes; the"
        f" largest had {max(counted['bytes'] for counted in _of_workers) / 1e9:.2f} GB"
    )
    loop = _loop_seconds()
    say(f"CPU: {_sum('cpu'):.0f} s, on a machine that loops 20 million times in {loop:.2f} s")
    if _too_many(_sum("kernels"), config):
        say(f"too many kernels: at most {MOST_KERNELS} (see tests/structures.py)")
