"""The automaton in a container on its spring: rigid limit, momentum, energy, effects, range."""

import re

import numpy as np
import pytest

from ca_damper import Automaton, Batch, Oscillator, SceneTable, needed_effects
from ca_damper.plot.boxes import BoxSize
from ca_damper.report.certificate import checked_range
from taichi_dem.kit.allocation import assign, values
from tests.damper import expected, paper

MASS, WIDTH, GRAVITY, DT = 0.2e-3, 6e-3, 10.0, 1e-4
OSCILLATOR = Oscillator()
NATURAL = OSCILLATOR.natural_frequency


@pytest.mark.parametrize("rules", [paper, Automaton], ids=["paper", "place"])
def test_rigid_limit(rules):
    """While x w^2 < g the heap never lifts: response of M + N m, mean -N m g / K, to 2e-3.

    A base of 0.1 mm; at 0.8 and 1.2 of the natural frequency x w^2 stays below g / 3, so that no
    particle keeps bouncing either. 200 cycles for the transient of 1 / (zeta w) = 2.2 s.
    """
    frequency, added = np.array([0.8, 1.2] * 2) * NATURAL, np.array([10, 10, 50, 50]) * MASS
    table = SceneTable([10, 10, 50, 50], 1, 2 * DT, frequency, 0.1e-3)
    batch = Batch(rules(), table, measured_cycles=20)
    with expected(batch):
        batch.start("rigid")
    cycles = batch.run(200, 20)
    gain = [OSCILLATOR.transfer(*scene) for scene in zip(frequency, added)]
    wanted = 0.1e-3 * np.abs(gain)
    assert np.all(wanted * cycles.omega**2 < GRAVITY / 3)
    assert cycles.rms * np.sqrt(2) == pytest.approx(wanted, rel=2e-3)
    assert cycles.mean == pytest.approx(-added * GRAVITY / OSCILLATOR.stiffness, rel=2e-3)
    assert cycles.apparent_mass == pytest.approx(added, rel=2e-3)
    assert abs(cycles.apparent_damping).max() < 2e-3 * OSCILLATOR.damping


def test_momentum_is_exact_and_no_grain_is_lost():
    """Hard shaking of 1 to 160 grains; every grain in a cell of its own and within the box."""
    particles = np.array([1, 10, 50, 100, 160])
    batch = Batch(Automaton(), SceneTable(particles, 3, DT, NATURAL, 5e-3))
    batch.start()
    for _ in range(5):
        batch.run(4, 0)
        for s, count in enumerate(particles.tolist()):
            position = batch.snapshot(s)["position"]
            assert len(position) == count
            below, above = BoxSize.of(batch.filling).gaps(position)
            # Half a cell into the wall would be in a cell of the wall.
            assert min(below.min(), above.min()) > -0.5 * WIDTH
    assert batch.report().momentum_error < 2e-12
    # A number has its noun.
    assert re.search(r"\b\d+ scenes? ", str(batch.report()).splitlines()[0])


@pytest.mark.filterwarnings("ignore:.*is read in .* likely")
def test_energy_of_heavy_grains_never_grows():
    """Grains of ten times the container's mass, without gravity, base at rest, a soft spring.

    Blows act over the step that follows, in which the grains stand still and the container flies by
    its new speed: energy is compared after it, to what the spring takes up in the run.
    """
    table = SceneTable(np.full(6, 12), np.arange(6) + 1, DT, 6.0, 0.0, 0.086, 1e-6, 0.0)
    batch = Batch(Automaton(gravity=0.0, particle_mass=0.86), table)
    batch.start()
    cells = values(batch.device.cells.across)
    kind = values(batch.device.cells.kind)
    cells[kind < 6] = np.random.default_rng(3).normal(size=(kind < 6).sum())
    assign(batch.device.cells.across, cells)
    total = []
    for _ in range(200):
        now = batch.sample()
        total.append(now["energy"] + 0.5 * 0.086 * now["v"] ** 2)
        batch.advance(20)
    total = np.array(total)
    assert np.all(total[0] > 0.0)
    assert np.all(np.diff(total, axis=0) <= 1e-6 * total[0])
    assert np.all(total[-1] < 0.9 * total[0])


def ran(filling, particles, amplitude):
    """The report of three cycles of a container that stands still, or shakes."""
    batch = Batch(filling, SceneTable(particles, 1, 1e-4, 6.0, amplitude))
    with expected(batch):
        batch.start()
    batch.run(3, 0)
    return batch.report()


def test_one_particle_meets_the_floor_and_nobody_else():
    report = ran(paper(), 1, 0.0)
    assert needed_effects(report).inactive == ("pairs", "ejection", "static contact")
    uses = {use.effect: use.events for use in report.effect_activity}
    assert uses["landing"] > 0
    assert needed_effects(ran(paper(), 40, 2e-3)).droppable == ()


#: A scene of the paper: 30 grains near resonance.
FEW = {"particles": 30, "seed": 1, "dt": 1e-4, "frequency": 6.0, "base_amplitude": 0.6e-3}
#: A container that is driven by 3.5 g.
DRIVEN = {**FEW, "base_amplitude": 24e-3}
#: Options, columns, mount, and what the sentence says.
FAILS = {
    "heavy": ({"particle_mass": 0.0087}, FEW, "spring", "a grain of 0.101 of the container's mass"),
    "ten": ({}, {**FEW, "particles": [10, 30]}, "spring", "10 grains, ten or fewer"),
    "slow": ({}, {**FEW, "base_amplitude": 6.5e-3}, "base", "a motion of 0.94 g, below 1 g"),
    "small": (
        *({}, {**FEW, "frequency": 25.0, "base_amplitude": 0.8e-3}, "base"),
        "a motion of 0.8 mm, below half a cell of 6 mm",
    ),
    "dead": ({"restitution": 0.49}, DRIVEN, "base", "restitution 0.49, below 0.5"),
}
INSIDE = {
    "heavy, driven": ({"particle_mass": 0.05}, DRIVEN, "base"),
    "resonance": ({}, FEW, "spring"),
    "still": ({}, {**FEW, "base_amplitude": 0.0}, "base"),
}


def checked(make, options, columns, mount):
    return checked_range(Batch(make(**options), SceneTable(**columns), mount=mount))


@pytest.mark.parametrize("name", FAILS)
def test_the_paper_s_rules_warn_before_a_run_where_they_fail(name):
    *scene, words = FAILS[name]
    assert words in checked(paper, *scene).warning
    assert not checked(Automaton, *scene).warning


@pytest.mark.parametrize("name", INSIDE)
def test_the_paper_s_rules_are_silent_inside_their_range(name):
    assert not checked(paper, *INSIDE[name]).warning


def test_a_run_says_where_rules_of_place_are_off():
    """Gravity across the columns is one of these places."""
    lying = checked(Automaton, {"gravity": (9.8, 0.0)}, FEW, "spring")
    upright = checked(Automaton, {"gravity": (0.0, 9.8)}, FEW, "spring")
    assert len(lying.outside) == len(upright.outside) + 1
    assert "gravity across the columns" in " ".join(lying.outside)
