"""What the report says of momentum and of the step: nothing comes from nowhere, or it is said."""

import pytest

from ca_damper import Automaton, Batch, Empty, RigidMass, SceneTable, Spheres
from tests.paper import expected, paper
from tests.rounding import momentum_rounding

PARTICLES = (1, 40)


def reported(filling, mount):
    """Report of a few cycles of hard shaking, and momentum that rounding may lose, as a share."""
    amplitude = 2e-3 if mount == "spring" else 20e-3
    table = SceneTable(PARTICLES if filling.capacity else 0, 1, filling.default_dt, 6.0, amplitude)
    batch = Batch(filling, table, mount=mount)
    with expected(batch):
        batch.start()
    batch.run(3, 0)
    return batch.report(), momentum_rounding(batch)


@pytest.mark.parametrize("mount", ["spring", "base"])
@pytest.mark.parametrize("filling", [RigidMass(), Automaton(), Spheres()], ids=lambda f: f.label)
def test_what_filling_and_container_exchange_is_accounted_for(filling, mount):
    """Momentum of the particles = -N m g t - what they gave to the container."""
    report, rounding = reported(filling, mount)
    assert report.momentum_error < rounding < 1e-8


@pytest.mark.parametrize("accounting", ["landing", "landing+ejection"])
def test_an_accounting_that_leaves_blows_out_is_found_out(accounting):
    """What is left out is of the order of what is counted: no rounding."""
    report, _ = reported(paper(accounting=accounting), "base")
    assert report.momentum_error > 0.1
    assert f"{report.momentum_error:.2g} of what was exchanged" in str(report)


def test_nothing_to_exchange_is_no_error():
    assert reported(Empty(), "spring")[0].momentum_error == 0.0
    table = SceneTable(1, 1, 1e-4, 6.0, 1e-3)
    assert Batch(Automaton(), table).report().momentum_error == 0.0


def test_report_says_what_bounds_the_step():
    """Width over v_max of the automaton, five steps in a contact of spheres, nothing of a mass."""
    automaton = Automaton(width=6e-3, v_max=4.0)
    table = SceneTable(1, 1, 1e-4, 6.0, 1e-3)
    text = str(Batch(automaton, table).report())
    assert "step bound by      a cell crossed at v_max: 0.0015 s, 0.067 of it taken" in text
    text = str(Batch(Spheres(), SceneTable(1, 1, 2e-5, 6.0, 1e-3)).report())
    assert f"five steps in a contact: {Spheres().safe_step():.3g} s" in text
    assert "step bound by" not in str(Batch(RigidMass(), table).report())
