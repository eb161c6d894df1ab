"""Engines that a test sets aside come back with their session, and never without it."""

import pytest

from ca_damper import Batch, RigidMass, SceneTable, runtime
from tests.own_engines import set_aside


def batch():
    """A batch of one scene, loaded into an engine."""
    return Batch(RigidMass(2e-4), SceneTable(1, 5, 1e-4))


@pytest.mark.parametrize("goes_on", [True, False])
def test_engines_come_back_only_while_their_session_goes_on(goes_on):
    settings = runtime.settings()
    engine = batch().loan.engine
    with pytest.MonkeyPatch.context() as patch:
        set_aside(patch)
        assert batch().loan.engine is not engine
        if not goes_on:
            runtime.stop()
            runtime.start(settings.arch, threads=settings.threads)
            batch()
    assert (batch().loan.engine is engine) == goes_on
