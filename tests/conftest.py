"""A Taichi session for all tests of a worker; tests of starting and stopping use subprocesses.

``pytest --arch cuda`` runs all kernels of this process, and all experiments, on a CUDA device.
A test marked ``attack`` that takes a seed is run once a seed.
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

from ca_damper.engine import damper_engine
from taichi_dem import InputError, runtime
from taichi_dem.engine import ENGINES
from taichi_dem.kit import backend
from taichi_dem.kit.allocation import field_bytes, tree_count
from taichi_dem.step.drivers import CPU_ONLY
from tests.processes import choose_arch, chosen_arch

pytest_plugins = ("tests.compiler",)


def pytest_addoption(parser):
    """The architecture, as every experiment has it; how many seeds, from which on."""
    parser.addoption("--arch", default="cpu", choices=("cpu", *backend.GPUS))
    group = parser.getgroup("attacks")
    group.addoption("--attacks", type=int, default=1, metavar="N", help="seeds of each attack")
    group.addoption("--attack-seed", type=int, default=0, metavar="S", help="the first of them")


def pytest_generate_tests(metafunc):
    """One test a seed."""
    if metafunc.definition.get_closest_marker("attack") and "seed" in metafunc.fixturenames:
        first = metafunc.config.getoption("--attack-seed")
        seeds = range(first, first + metafunc.config.getoption("--attacks"))
        metafunc.parametrize("seed", seeds)


def pytest_configure(config):
    """Hand the choice on."""
    choose_arch(config.getoption("--arch"))


#: Folders of the first worker, whose structures are those of the paper, of bonds and of bodies.
OF_THE_FIRST = ("verification", "equivalence", "material", "boundaries")


class InHalves(LoadScopeScheduling):
    """Each worker runs its half of the tests in their order, so that a second run finds in the
    cache what the first has compiled: fields of a session are numbered as they are made.

    Experiments, which run in processes of their own, share nothing.
    """

    def _split_scope(self, nodeid):
        folder = Path(nodeid.partition("::")[0]).parent.name
        return nodeid if folder == "experiments" else str(folder in OF_THE_FIRST)


def pytest_collection_modifyitems(items):
    """The folder unit last in its half, as it shares least where a session has to end."""
    items.sort(key=lambda item: item.path.parent.name == "unit")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Take the place of ``--dist loadscope``; None for all others."""
    return InHalves(config, log) if config.getoption("dist") == "loadscope" else None


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


#: LLVM keeps memory for each thread that compiles: a quarter more with four of them, which each
#: worker would have beside the other's.
runtime.ti.init = functools.partial(runtime.ti.init, num_compile_threads=1)

#: Room of the damper's engines for nearly all tests, so that each structure is compiled once.
damper_engine._POOL.least = (64, 128, 4096, 512, 4096, *(256,) * 32)

#: Bytes of the process beyond which the next file begins with another session, if that of before
#: has taken a good part of them.
_MOST_BYTES, _LEAST_GROWTH = 1.9e9, 0.25e9
_MOST_TREES = 300
_at_start = {}


@pytest.fixture(scope="module", autouse=True)
def taichi_session():
    """Two threads, whatever the machine has: results must not depend on their number.

    All files of a worker share a session, and so what has been compiled, if there is room.
    """
    _give_back()
    if runtime.settings() is not None and _is_full():
        _stop()
    if chosen_arch() != "cpu" and not backend.is_present(chosen_arch()):
        pytest.skip(f"no {chosen_arch()} device answers here")
    if runtime.settings() is None:
        _at_start["bytes"] = _resident_bytes()
    runtime.start(chosen_arch(), threads=2)


def _is_full():
    started = runtime.settings()
    other = (started.arch, started.threads, started.debug) != (chosen_arch(), 2, False)
    size = _resident_bytes()
    grown = size - _at_start.get("bytes", 0)
    is_full = size > _MOST_BYTES and grown > _LEAST_GROWTH
    return other or is_full or tree_count() > _MOST_TREES


def _resident_bytes():
    """Memory that this process occupies; where the system does not tell, that of the fields."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return field_bytes()
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_teardown(item, nextitem):
    """Let go of the runs that a folder has kept after its last test: their engines serve others."""
    yield
    if nextitem is None or nextitem.path.parent != item.path.parent:
        for name, module in list(sys.modules.items()):
            if name.startswith("tests."):
                _forget_runs(module)
        if nextitem is None:
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


@pytest.fixture
def compiled_anew(monkeypatch):
    """Engines of this test alone: for constants of kernels that a test changes."""
    for pool in (ENGINES, damper_engine._POOL):
        # With its session: engines come back only while theirs goes on. One of an ended session
        # ends the process, or writes into the fields of others.
        monkeypatch.setattr(pool, "_session", None)
        monkeypatch.setattr(pool, "_engines", {})


def _skipping():
    """Skip, with the reason, what needs the driver that only a CPU has."""
    try:
        return (yield)
    except InputError as error:
        if chosen_arch() != "cpu" and CPU_ONLY in str(error):
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
