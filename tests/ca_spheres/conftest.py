"""A Taichi session for every file: what one session may allocate in its life is limited."""

import pytest

from taichi_dem import runtime


@pytest.fixture(scope="module", autouse=True)
def taichi_session_of_the_file(taichi_session):
    """Start anew, as nothing that was made in another file is in use any more."""
    runtime.stop()
    runtime.start(threads=2)
