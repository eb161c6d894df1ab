"""Small scenes of both packages with Taichi's checks on: no kernel reaches beyond a field.

``make test-bounds`` runs this file alone. A release kernel that reads beyond a field says nothing.
"""

import numpy as np
import pytest
import taichi as ti

from ca_damper import Automaton, Batch, RigidMass, SceneTable, Spheres
from taichi_dem import CONCRETE, Multirate, Scene, Simulation, Uniform, effects, runtime
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.output.record import Recorder
from taichi_dem.timeline import MACRO_TICKS
from tests.activation.late_scenes import late_scene, scene_of
from tests.activation.late_scenes import simulation as started
from tests.bar_blast import METHODS
from tests.paper import expected, paper
from tests.scenes import paper_effects

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def taichi_session():
    """In place of the other tests' session: one that checks bounds."""
    runtime.stop()
    runtime.start(threads=2, debug=True)
    yield
    runtime.stop()


@ti.kernel
def _beyond(field: ti.template(), k: ti.i32) -> ti.f64:
    return field[k]


def test_a_place_beyond_a_field_is_noticed():
    """Or else all that follows here would show nothing."""
    field = ti.field(ti.f64, shape=3)
    assert _beyond(field, 2) == 0.0
    with pytest.raises(
        AssertionError, match=r"Accessing field .* of size \(3\) with indices \(3\)"
    ):
        _beyond(field, 3)


CONTROLLED = METHODS["controlled"]
DRIFTED = Multirate(8e-8, 1e-5, "drifted", CONTROLLED.control, "limited")
BLASTS = {
    "implicit": (METHODS["implicit"], "resident"),
    "multirate": (CONTROLLED, "parallel"),
    "drifted": (DRIFTED, "resident"),
    "uniform": (Uniform(4e-8, dashpot="limited"), "resident"),
}


def blown_bar():
    """Twelve bodies with all effects, spheres on all faces, pulled apart faster than bonds bear."""
    gas = effects.GasPressure("top", peak=5e7, rise=5e-6)
    held = effects.Fixed("right"), effects.PrescribedMotion("left", (-10.0, 0.0, 0.0))
    listed = [*paper_effects(outer_faces=True)[:-1], gas, effects.Gravity(), *held]
    return Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, listed)


@pytest.mark.parametrize("name", BLASTS)
def test_a_blast_stays_within_its_fields(name):
    """Bonds are released, what broke is searched for contacts and touches, rows are written."""
    method, driver = BLASTS[name]
    simulation = Simulation(blown_bar(), method, driver)
    recorder = Recorder(simulation, "top")
    simulation.start()
    steps = round(4e-5 / method.dt0)
    simulation.advance_to(steps)
    recorder.sample()
    recorder.snapshot()
    report = simulation.report()
    assert simulation.state.tick[None] == steps * MACRO_TICKS
    assert report.broken_faces > 0
    assert report.pair_evaluations > 0


def test_a_body_without_bonds_stays_within_its_fields():
    """Lists and tables of nothing."""
    scene = Scene(single(), CONCRETE, [effects.Softening(), effects.SphereContact()])
    simulation = Simulation(scene, CONTROLLED)
    simulation.advance_to(50)
    assert np.isfinite(simulation.state.position.to_numpy()).all()


ON_DEMAND = {
    "parallel": ("strained 0", CONTROLLED, "parallel", 50),
    "drifted": ("fragment 0", DRIFTED, "resident", 200),
    "implicit": ("strained 0", METHODS["implicit"], "resident", 50),
}


@pytest.mark.parametrize("name", ON_DEMAND)
def test_effects_on_demand_stay_within_their_fields(name):
    """Bodies sleep and wake, laws begin, and one in 1024 bonds is audited."""
    which, method, driver, steps = ON_DEMAND[name]
    simulation = started(late_scene(which), scene_of(late_scene(which)), method, driver)
    simulation.start()
    before = (simulation.state.sleeping.awake.to_numpy() == 0).sum()
    simulation.advance_to(steps)
    assert simulation.report().certificate.law_evaluations > 0
    assert (simulation.state.sleeping.awake.to_numpy() == 0).sum() < before


FILLINGS = {
    "automaton": (Automaton(ledger=False), 1e-3),
    "scan": (paper(traversal="scan", accounting="landing", ledger=True), 1e-3),
    "one sided": (paper(pair_rule="one_sided", accounting="landing+ejection"), 1e-3),
    "named cells": (Automaton(start=[(0, 0), (9, 15), (4, 7)]), 1e-3),
    "one cell": (Automaton(columns=1, rows=1), 1e-3),
    "spheres": (Spheres(), 2e-5),
    "turning spheres": (Spheres(rotation=True, search="all_pairs"), 2e-5),
    "spheres that stick": (Spheres(friction_law="history", rotation=True), 2e-5),
    "two sizes": (Spheres(friction_law="history", sizes=((30, 6e-3), (60, 4e-3))), 2e-5),
    "one sphere": (Spheres(width=6e-3, height=6e-3), 2e-5),
    "rigid": (RigidMass(), 1e-3),
}


@pytest.mark.parametrize("name", FILLINGS)
def test_a_shaken_filling_stays_within_its_fields(name):
    """Empty, nearly empty and full boxes, shaken over two cycles by four of gravity."""
    filling, dt = FILLINGS[name]
    most = min(filling.capacity, 160)
    counts = [0, 1, most // 2, most] if name != "two sizes" else [90]
    if getattr(filling, "start", None) is not None:
        counts = [len(filling.start)]
    table = SceneTable(counts, range(1, 1 + len(counts)), dt, 8.0, 4.0 * 10.0 / 50.0**2)
    batch = Batch(filling, table, mount="base", measured_cycles=1)
    with expected(batch):
        batch.start("rigid")
    cycles = batch.run(1, 1)
    assert np.isfinite(cycles.record).all()
    assert all(np.isfinite(batch.snapshot(s)["position"]).all() for s in range(batch.count))
