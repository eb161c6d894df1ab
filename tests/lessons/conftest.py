"""The engine of the lessons, which wants Taichi for its own thread."""

import pytest

from taichi_dem import runtime


@pytest.fixture(scope="module")
def engine(taichi_session):
    """The engine that the lessons share, with two threads; compiled programs last for a file."""
    from _engine import engine as shared

    runtime.stop()
    shared.threads = 2
    yield shared
    shared.close()
    shared.threads = None
