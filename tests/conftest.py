"""A Taichi session for all tests of a worker; tests of starting and stopping use subprocesses.

``pytest --arch cuda`` runs all kernels of this process, and all experiments, on a CUDA device.
Options of the attacks are those of ``tests/attacks.py``.
"""

import contextlib
import ctypes
import faulthandler
import functools
import gc
import os
import sys
from pathlib import Path

import pytest
from xdist.scheduler import LoadScopeScheduling

from taichi_dem import InputError, runtime
from taichi_dem.kit.allocation import field_bytes, tree_count
from taichi_dem.step.auto_driver import CPU_ONLY
from tests import arch

pytest_plugins = ("tests.attacks", "tests.compiler", "tests.own_engines")


def pytest_addoption(parser):
    """The architecture, as every experiment has it."""
    parser.addoption("--arch", default="cpu", choices=runtime.ARCHITECTURES)


def pytest_configure(config):
    """Hand the choice on."""
    arch.choose(config.getoption("--arch"))


class ByGroup(LoadScopeScheduling):
    """Tests of a group run in one worker: they share engines, which are compiled once.

    Experiments, which run in processes of their own, share nothing.
    """

    def _split_scope(self, nodeid):
        group = group_of(Path(nodeid.partition("::")[0]))
        return nodeid if group == "experiments" else group


def group_of(path):
    """Group of a test file: its folder, all of the damper as one, and all that share the block."""
    folder = path.parent.name
    return "verification" if folder == "equivalence" else folder.partition("_")[0]


#: Groups that take longest: begun first, so that workers end together.
FIRST = ("verification", "unit", "ca", "activation")


def pytest_collection_modifyitems(items):
    """Long groups first; in the first, what runs the same block side by side."""
    rank = {name: place for place, name in enumerate(FIRST)}

    def place(item):
        group = group_of(item.path)
        return rank.get(group, len(rank)), item.path.name if group == FIRST[0] else ""

    items.sort(key=place)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Take the place of ``--dist loadscope``; None for all others."""
    return ByGroup(config, log) if config.getoption("dist") == "loadscope" else None


#: Longest time of one test [s]; the longest takes two minutes on a busy machine.
MOST_SECONDS = 900


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """End a process whose test hangs, by a thread that needs no Python."""
    faulthandler.dump_traceback_later(MOST_SECONDS, exit=True)
    try:
        return (yield)
    finally:
        faulthandler.cancel_dump_traceback_later()


#: Bytes by which the process has grown in a session beyond which the next file begins with another.
_MOST_GROWTH = 0.7e9
_MOST_TREES = 200
_at_start = {}


@pytest.fixture(scope="module", autouse=True)
def taichi_session():
    """Two threads, whatever the machine has: results must not depend on their number.

    Files of a group share a session, and so the engines that have been compiled, if there is room.
    """
    _give_back()
    if runtime.settings() is not None and _is_full():
        _stop()
    if arch.chosen() == "cuda" and not runtime.cuda_present():
        pytest.skip("no CUDA device answers here")
    if runtime.settings() is None:
        _at_start["bytes"] = _resident_bytes()
    runtime.start(arch.chosen(), threads=2)


def _is_full():
    started = runtime.settings()
    other = (started.arch, started.threads, started.debug) != (arch.chosen(), 2, False)
    grown = _resident_bytes() - _at_start.get("bytes", 0)
    return other or grown > _MOST_GROWTH or tree_count() > _MOST_TREES


def _resident_bytes():
    """Memory that this process occupies; where the system does not tell, that of the fields."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return field_bytes()
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item, nextitem):
    """Give the memory of a group back after its last test: engines, and runs that it has kept."""
    yield
    group = group_of(item.path)
    if nextitem is None or group_of(nextitem.path) != group:
        for module in list(sys.modules.values()):
            path = Path(getattr(module, "__file__", None) or "")
            if path.parent.parent == item.path.parent.parent and group_of(path) == group:
                _forget_runs(module)
        _stop()


def _forget_runs(module):
    """Empty the caches of functions of a module."""
    for kept in vars(module).values():
        if isinstance(kept, functools._lru_cache_wrapper):
            kept.cache_clear()


def _stop():
    """Stop Taichi, and give what is free back to the system."""
    if runtime.settings() is not None:
        runtime.stop()
    _give_back()


def _give_back():
    """Give what is free back to the system, where the C library can: compiling leaves much."""
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def _skipping():
    """Skip, with the reason, what needs the driver that only a CPU has."""
    try:
        return (yield)
    except InputError as error:
        if arch.chosen() == "cuda" and CPU_ONLY in str(error):
            pytest.skip(str(error))
        raise


@pytest.hookimpl(wrapper=True)
def pytest_pyfunc_call(pyfuncitem):
    """A test may ask for the resident driver."""
    return (yield from _skipping())


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef, request):
    """So may what it is given."""
    return (yield from _skipping())
