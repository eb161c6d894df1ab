"""The engine of the lessons, which wants Taichi for its own thread."""

import pytest

from taichi_dem import runtime


@pytest.fixture(scope="module")
def engine(taichi_session):
    """The engine that the lessons share, with two threads; compiled programs last for a file."""
    from taichi_dem.kit.session_thread import session as shared

    runtime.stop()
    shared.threads = 2
    yield shared
    shared.close()
    shared.threads = None
