"""The audit finds sleep that is too deep."""

import pytest
import taichi as ti

from taichi_dem.kit.products import squared
from taichi_dem.step import phases
from taichi_dem.step.sleeping import Sleeping
from tests.activation.late_runs import Run

pytestmark = pytest.mark.slow


@ti.func
def too_deep(self, i, is_fast):
    """Whether a body is a million times as fast as one that wakes others."""
    return squared(self.state.velocity[i]) > 1e12 * self.bound2[self.part[i]]


def test_sleep_that_is_too_deep_is_found(monkeypatch, compiled_anew):
    """Every bond is audited in every substep, in engines of this test alone."""
    monkeypatch.setattr(phases, "RATE", 1)
    compiled_anew()
    monkeypatch.setattr(Sleeping, "_opens", too_deep)
    made = Run("far_end 0", "auto")
    assert made.misses > 0
    assert not made.report.certificate.holds
