"""A Taichi session for every test file; tests of starting and stopping use subprocesses."""

import pytest

from taichi_dem import runtime


@pytest.fixture(scope="module", autouse=True)
def taichi_session():
    """Two threads, whatever the machine has: results must not depend on their number.

    A session a file: Taichi crashes beyond 512 groups of fields in one.
    """
    runtime.stop()
    runtime.start(threads=2)
