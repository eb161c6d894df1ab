"""An accounting of one's own: one class, one line in the table, and all that goes with it."""

import pytest
import taichi as ti

from ca_damper import Batch, SceneTable
from ca_damper.automaton.accounting import ACCOUNTINGS, Uncounted
from ca_damper.automaton.impulse_balance import ITEMS, quanta
from tests.ca_automaton.test_momentum import ledger, shaken, test_momentum_is_accounted_for
from tests.paper import outside, paper


@ti.data_oriented
class Half(Uncounted):
    """Of every blow and push a half counts, and the other is left out."""

    labels = ("ca_half", "ca_half_static")
    effects = ("ejection",)

    @ti.func
    def wall_impulse(self, s, cell, gain):
        """Count half of a blow [quanta]."""
        left_out = Uncounted.wall_impulse(self, s, cell, 0.5 * gain)
        return quanta(0.5 * gain) + left_out

    @ti.func
    def push(self, s, gain):
        """Count half of a push [quanta]."""
        left_out = Uncounted.push(self, s, 0.5 * gain)
        return quanta(0.5 * gain) + left_out


@pytest.fixture(autouse=True)
def table_with_half(monkeypatch):
    """The one line."""
    monkeypatch.setitem(ACCOUNTINGS, "half", Half)


@pytest.mark.parametrize("static_contact", [False, True])
def test_its_momentum_is_accounted_for(static_contact):
    test_momentum_is_accounted_for({"accounting": "half", "static_contact": static_contact})


def test_what_it_leaves_out_is_written_down():
    left = ledger(shaken(3000, accounting="half")) != 0
    assert left[2, [ITEMS.index("ejections"), ITEMS.index("rest")]].all()


def test_it_has_its_words():
    automaton = paper(accounting="half")
    assert automaton.label == "ca_half"
    assert automaton.effects == ("pairs", "landing", "ejection")
    assert paper(accounting="half", static_contact=True).label == "ca_half_static"


def test_a_container_at_rest_feels_half_of_the_weight():
    """Of one particle that lies on the floor: m g / 2, to the momentum of 4 g dt at the ends."""
    automaton, cycles = paper(accounting="half", start=((4, 15),)), 12
    table = SceneTable(1, 1, 1e-4, 6.0)
    batch = Batch(automaton, table, mount="base", measured_cycles=cycles)
    with outside():
        batch.start()
    force = batch.run(12, cycles).mean_force[0]
    bound = 2 * 4 * 1e-4 / (cycles / 6.0)
    weight = automaton.particle_mass * automaton.gravity
    assert force == pytest.approx(-0.5 * weight, rel=bound)
