"""The audit finds faults planted in laws and in sleep, finds none elsewhere, and changes no bit."""

import math

import numpy as np
import pytest
import taichi as ti

from taichi_dem import Scene
from taichi_dem.effects import ShearSlip, Softening
from taichi_dem.kit.allocation import assign
from taichi_dem.step import audit
from taichi_dem.step.audit import KINDS
from taichi_dem.step.sleeping import Sleeping
from tests.activation.late_runs import BITS, Run, run
from tests.activation.late_scenes import METHOD, SCENES, late_scene, material_of, simulation
from tests.activation.test_late_methods import METHODS

SOFTENING, SLIP, ASLEEP = range(3)
#: Of a power of two of bonds one is audited: all, and as good as none.
ALL, NONE = 1, 1 << 30
DRAWN = list(SCENES)[::2]
SLOW = pytest.mark.slow


@pytest.fixture
def rate(monkeypatch, compiled_anew):
    """Set the share that is audited, in engines of this test alone: it is a constant of kernels."""

    def change(value):
        monkeypatch.setattr(audit, "RATE", value)
        compiled_anew()

    return change


def missed(simulation):
    """Misses by kind."""
    return simulation.step.audit.misses.to_numpy().tolist()


def same_bits(first, second):
    """Names of the fields of two runs whose bits differ."""
    return [name for name in BITS if not np.array_equal(first.fields[name], second.fields[name])]


@pytest.mark.slow
def test_one_bond_in_1024_is_audited():
    """The number of a run is binomial: within five standard deviations."""
    made = [run(name, sleep=0.0).simulation for name in DRAWN]
    units = sum(int(each.step.audit.audited.to_numpy()[SOFTENING]) for each in made)
    audited, expected = units / 3, sum(each.evaluations() for each in made) / audit.RATE
    assert expected > 300
    assert abs(audited - expected) < 5.0 * math.sqrt(expected)


@pytest.mark.slow
def test_twenty_scenes_without_fault_have_no_miss_and_the_same_bits(rate):
    """With every bond audited in every substep.

    Of the units of a bond that begins, those before the one that does were skipped, not audited.
    """
    before = {name: run(name) for name in DRAWN}
    rate(ALL)
    assert len(DRAWN) >= 20
    for name in DRAWN:
        made = Run(name, "auto")
        assert missed(made.simulation) == [0, 0, 0], name
        activity, listed = made.simulation.state.activity, made.simulation.schedule.evaluations[5]
        skipped = 3 * int(listed) - activity.evaluated.to_numpy()[:, SOFTENING].sum()
        begun = (activity.since.to_numpy()[:, SOFTENING] >= 0).sum()
        audited = made.simulation.step.audit.audited.to_numpy()[SOFTENING]
        assert skipped - 2 * begun <= audited <= skipped, name
        assert same_bits(before[name], made) == [], name


@SLOW
@pytest.mark.parametrize("method", ["controlled", "drifted", "implicit"])
def test_other_methods_have_no_miss(rate, method):
    """Also where bonds apply their impulses ahead, and bodies wait for theirs."""
    names = ("far_end 0", "far_end_slips 2", "hit 0", "fragment 0", "one_body 0", "strained 0")
    before = {name: run(name, method=METHODS[method]) for name in names}
    rate(ALL)
    for name in names:
        made = Run(name, "auto", method=METHODS[method])
        assert missed(made.simulation) == [0, 0, 0], name
        assert same_bits(before[name], made) == [], name


@ti.data_oriented
class LooseSoftening(Softening):
    """A law that says too late when it begins."""

    activation = "a unit is opened to half as much again as its strength"

    @ti.func
    def begins(self, m, stiffness, opening):
        """1 beyond 1.5 times the strength."""
        return ti.cast(stiffness * opening > 1.5 * self.law[m, 0], ti.i32)


@ti.data_oriented
class LooseSlip(ShearSlip):
    """The same of the shear law."""

    activation = "a unit is sheared to half as much again as its limit"

    @ti.func
    def begins(self, m, stiffness, sliding, pressure):
        """1 beyond 1.5 times the limit."""
        limit = 1.5 * (self.law[m, 0] + self.law[m, 1] * pressure)
        return ti.cast(stiffness * sliding.norm() > limit, ti.i32)


class Loose:
    """A run of a late scene with loose laws."""

    def __init__(self, name, word="auto", laws=(LooseSoftening, LooseSlip), **options):
        late = late_scene(name)
        loads = [*late.loads, *(law() for law in laws)]
        scene = Scene(late.mesh, material_of(late), word, loads=loads, **options)
        self.simulation = simulation(late, scene)
        self.simulation.advance_to(round(late.until / METHOD.dt0))
        self.fields = {k: f.to_numpy() for k, f in self.simulation.state.fields().items()}


@pytest.mark.slow
def test_laws_that_begin_too_late_are_found_and_no_bit_changes(rate):
    """Each bond that should act is a miss in every substep, and the certificate does not hold."""
    names = {
        "far_end 0": SOFTENING,
        "meeting 1": SOFTENING,
        "far_end_slips 0": SLIP,
        "aside 0": SLIP,
    }
    rate(NONE)
    unseen = {name: Loose(name) for name in names}
    rate(ALL)
    for name, law in names.items():
        found = Loose(name)
        counts = missed(found.simulation)
        assert counts[law] > 0, name
        assert [count for kind, count in enumerate(counts) if kind != law] == [0, 0], name
        assert same_bits(unseen[name], found) == [], name
        certificate = found.simulation.report().certificate
        assert not certificate.holds and "does not hold" in str(certificate)
        assert not np.array_equal(found.fields["position"], run(name, "all").fields["position"])
    assert sum(sum(missed(each.simulation)) for each in unseen.values()) == 0


@ti.func
def too_deep(self, i, is_fast, advance):
    """Whether a body is a million times as fast as one that wakes others."""
    speed2 = advance.state.velocity[i].norm_sqr()
    return speed2 > 1e12 * self.bound2[self.part[i]]


@SLOW
def test_sleep_that_is_too_deep_is_found(rate, monkeypatch):
    monkeypatch.setattr(Sleeping, "_opens", too_deep)
    rate(ALL)
    for name in ("far_end 0", "hit 0"):
        made = Run(name, "auto")
        assert missed(made.simulation)[ASLEEP] > 0, name
        assert not made.report.certificate.holds


@ti.data_oriented
class CountedSoftening(Softening):
    """Softening that counts the calls of each bond that is opened, and weakens with them."""

    activation = Softening.activation
    begins = Softening.begins

    def declare(self, capacity):
        """Calls of every bond."""
        super().declare(capacity)
        self.calls = ti.field(ti.f64, shape=capacity.bonds)

    def load(self, model):
        """No call yet."""
        super().load(model)
        assign(self.calls, np.zeros(model.bond_count))

    def state(self):
        """Beside those of softening."""
        return {**super().state(), "calls": self.calls}

    @ti.func
    def traction(self, m, stiffness, u, opening):
        """Traction that falls with every call beyond the strength [Pa]."""
        traction = stiffness * opening
        if traction > self.law[m, 0]:
            self.calls[u // 3] = self.calls[u // 3] + 1.0
        return traction / (1.0 + 1e-3 * self.calls[u // 3])


@SLOW
def test_memory_of_bonds_survives_the_audit(rate):
    """Of a law of the user's that keeps an entry for each bond, beside those for units."""
    laws, found = (CountedSoftening,), []
    for share in (NONE, ALL):
        rate(share)
        found.append(Loose("far_end 0", laws=laws))
    assert found[0].fields["calls"].sum() > 10
    assert same_bits(*found) == []
    assert np.array_equal(found[0].fields["calls"], found[1].fields["calls"])
    every = Loose("far_end 0", "all", laws)
    assert np.array_equal(found[0].fields["calls"], every.fields["calls"])


def test_kinds_are_those_that_are_told():
    assert KINDS == ("softening", "slip", "asleep")
