"""Engines of one test alone, as a fixture."""

import functools

import pytest

from ca_damper.engine import damper_engine
from taichi_dem.engine import ENGINES


@pytest.fixture
def compiled_anew(monkeypatch):
    """Engines of this test alone: for constants of kernels that a test changes; calls drop them."""
    set_aside(monkeypatch)
    return functools.partial(set_aside, monkeypatch)


def set_aside(monkeypatch):
    """Leave all pools without an engine until the patches are undone."""
    for pool in (ENGINES, damper_engine._POOL):
        # With its session: engines come back only while theirs goes on. One of an ended session
        # ends the process, or writes into the fields of others.
        monkeypatch.setattr(pool, "_session", None)
        monkeypatch.setattr(pool, "_engines", {})
