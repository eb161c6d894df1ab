"""Momentum that filling and container exchange comes from nowhere, or the report says how much."""

import pytest

from ca_damper import Automaton, Batch, RigidMass, SceneTable, Spheres
from tests.ca_oscillator.kicks import Kicks
from tests.rounding import momentum_rounding


def shaken(filling):
    """A batch after a few cycles of hard shaking of 1 and of 10 or 40 particles."""
    table = SceneTable((1, min(40, filling.capacity)), 1, filling.default_dt, 6.0, 2e-3)
    batch = Batch(filling, table)
    batch.start()
    batch.run(3, 0)
    return batch


@pytest.mark.parametrize("filling", [RigidMass(), Automaton(), Spheres()], ids=lambda f: f.label)
def test_what_filling_and_container_exchange_is_accounted_for(filling):
    """Momentum of the particles = -N m g t - what they gave to the container."""
    batch = shaken(filling)
    assert batch.report().momentum_error < momentum_rounding(batch) < 1e-8


def test_blows_that_no_momentum_stands_for_are_found_out():
    """What is missing is of the order of what is counted: no rounding."""
    report = shaken(Kicks(strength=2e-5, mass=0.005)).report()
    assert report.momentum_error > 0.1
    assert f"{report.momentum_error:.2g} of what was exchanged" in str(report)
