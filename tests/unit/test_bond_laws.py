"""Below its limit every law of bonds is linear to the bit, as effects="auto" takes for granted.

Where ``begins`` says that a unit is far from its limits, the traction is stiffness times jump, no
energy is spent, nothing fails, and the memory of the law stays as it was.
"""

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, Scene, Simulation, Uniform
from taichi_dem.effects import CohesiveCrack, MixedMode, ShearSlip, SlipWeakening, Softening
from taichi_dem.kit.allocation import assign, values
from taichi_dem.laws.base import NEAR
from taichi_dem.mesh.shapes import pair

LAWS = {
    "paper": [Softening(), ShearSlip()],
    "weakening": [Softening(), SlipWeakening(500.0)],
    "mixed": [MixedMode(500.0, 1.75)],
    "crack": [CohesiveCrack()],
}
#: Units of the smallest engine.
UNITS = 6000


@ti.data_oriented
class Asked:
    """The law of bonds of a pair, asked for many units at once.

    found: begins, traction, slipped, failed of each unit; jumps [m].
    """

    def __init__(self, laws):
        self.simulation = Simulation(Scene(pair(), CONCRETE, laws), Uniform())
        self.tables, self.state = self.simulation.tables, self.simulation.state

    @ti.kernel
    def ask(
        self,
        jumps: ti.types.ndarray(dtype=ti.f64, ndim=2),
        found: ti.types.ndarray(dtype=ti.f64, ndim=2),
    ):
        stiffness = self.tables.bond_stiffness[0]
        for u in range(UNITS):
            jump = ti.Vector([jumps[u, 0], jumps[u, 1], jumps[u, 2]])
            found[u, 0] = self.tables.bond.begins(0, stiffness, jump)
            traction, slipped = self.tables.bond.traction(0, u, stiffness, jump)
            found[u, 4] = slipped
            found[u, 5] = self.tables.bond.failed(0, u, traction)
            for k in ti.static(range(3)):
                found[u, 1 + k] = traction[k]

    def fields(self):
        """What the law remembers, a row a unit."""
        return [f for name, f in self.state.fields().items() if name.endswith(("_unit", "_slip"))]

    def make_intact(self):
        """Every unit as those of the pair are."""
        for field in self.fields():
            whole = values(field)
            whole[:] = whole[0]
            assign(field, whole)


def drawn(rng):
    """Jumps [m] of all sizes about the limits, most of them near one."""
    onset = CONCRETE.tensile_strength / CONCRETE.normal_stiffness
    size = onset * 10.0 ** rng.uniform(-3.0, 1.0, (UNITS, 1))
    way = rng.normal(size=(UNITS, 3)) * rng.choice([0.0, 1.0], (UNITS, 3), p=[0.2, 0.8])
    jumps = size * way
    # Upon the limit in tension itself, and just below what is taken for near it.
    jumps[:8] = 0.0
    jumps[:8, 0] = onset * (NEAR + 1e-10 * np.arange(-4, 4))
    return jumps


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_linear_to_the_bit_where_it_does_not_begin(name):
    asked = Asked(LAWS[name])
    asked.make_intact()
    jumps, found = drawn(np.random.default_rng(5)), np.zeros((UNITS, 6))
    before = [values(field)[:UNITS] for field in asked.fields()]
    asked.ask(jumps, found)
    far = found[:, 0] == 0
    assert 0.2 * UNITS < far.sum() < 0.95 * UNITS
    stiffness = np.array([CONCRETE.normal_stiffness, *2 * [CONCRETE.shear_stiffness]])
    assert np.array_equal(found[far, 1:4], (stiffness * jumps)[far])
    assert not found[far, 4:].any()
    for old, field in zip(before, asked.fields()):
        new = values(field)[:UNITS]
        assert np.array_equal(old[far], new[far])
        # And where it begins, most laws have something to remember.
        assert not np.array_equal(old[~far], new[~far])
