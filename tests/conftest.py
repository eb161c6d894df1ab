"""One Taichi session for all tests of a worker; tests of starting and stopping use subprocesses."""

import pytest

from taichi_dem import runtime


@pytest.fixture(scope="session", autouse=True)
def taichi_session():
    """Two threads, whatever the machine has: results must not depend on their number."""
    runtime.start(threads=2)
