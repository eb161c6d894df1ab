"""The audit finds faults that are planted in laws and in sleep."""

import pytest
import taichi as ti

from taichi_dem import Scene
from taichi_dem.effects import Softening
from taichi_dem.step import audit
from taichi_dem.step.sleeping import Sleeping
from tests.activation.late_runs import Run
from tests.activation.late_scenes import METHOD, late_scene, material_of, simulation

SOFTENING, SLIP, ASLEEP = range(3)
pytestmark = pytest.mark.slow


@pytest.fixture
def every_bond(monkeypatch, compiled_anew):
    """Audit every bond in every substep, in engines of this test alone."""
    monkeypatch.setattr(audit, "RATE", 1)
    compiled_anew()


def missed(simulation):
    """Misses by kind."""
    return simulation.values(simulation.step.audit.misses).tolist()


@ti.data_oriented
class LooseSoftening(Softening):
    """A law that says too late when it begins."""

    activation = "a unit is opened to half as much again as its strength"

    @ti.func
    def begins(self, m, stiffness, opening):
        """1 beyond 1.5 times the strength."""
        return ti.cast(stiffness * opening > 1.5 * self.law[m, 0], ti.i32)


def test_a_law_that_begins_too_late_is_found(every_bond):
    """Each bond that should act is a miss in every substep, and the certificate does not hold."""
    late = late_scene("far_end 0")
    scene = Scene(late.mesh, material_of(late), "auto", loads=[*late.loads, LooseSoftening()])
    loose = simulation(late, scene)
    loose.advance_to(round(late.until / METHOD.dt0))
    counts = missed(loose)
    assert counts[SOFTENING] > 0 and counts[SLIP] == counts[ASLEEP] == 0
    assert not loose.report().certificate.holds


@ti.func
def too_deep(self, i, is_fast, advance):
    """Whether a body is a million times as fast as one that wakes others."""
    speed2 = advance.state.velocity[i].norm_sqr()
    return speed2 > 1e12 * self.bound2[self.part[i]]


def test_sleep_that_is_too_deep_is_found(monkeypatch, every_bond):
    monkeypatch.setattr(Sleeping, "_opens", too_deep)
    made = Run("far_end 0", "auto")
    assert made.misses[ASLEEP] > 0
    assert not made.report.certificate.holds
