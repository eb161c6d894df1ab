"""A Taichi session for every test file; tests of starting and stopping use subprocesses.

``pytest --arch cuda`` runs all kernels of this process, and all experiments, on a CUDA device.
"""

import pytest

from taichi_dem import InputError, runtime
from taichi_dem.simulation import CPU_ONLY
from tests import arch


def pytest_addoption(parser):
    """The architecture, as every experiment has it."""
    parser.addoption("--arch", default="cpu", choices=runtime.ARCHITECTURES)


def pytest_configure(config):
    """Hand the choice on."""
    arch.choose(config.getoption("--arch"))


@pytest.fixture(scope="module", autouse=True)
def taichi_session():
    """Two threads, whatever the machine has: results must not depend on their number.

    A session a file: Taichi crashes beyond 512 groups of fields in one.
    """
    runtime.stop()
    if arch.chosen() == "cuda" and not runtime.cuda_present():
        pytest.skip("no CUDA device answers here")
    runtime.start(arch.chosen(), threads=2)


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
