"""The reverse of bad input: whatever lies within the ranges runs, and its numbers stay finite.

What is drawn is drawn where a step can be said that does: a fifth of what the mesh allows, or that
of the contacts. Nothing may diverge there.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ca_damper import Batch, Oscillator, RigidMass, SceneTable, Spheres
from taichi_dem import (
    ImplicitDashpots,
    Material,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    quality_report,
    step_report,
)
from taichi_dem.mesh.shapes import bar, pair, single
from tests.bad_input.refusals import ends_within, steady
from tests.paper import expected, paper

few = settings(steady, max_examples=3)


def logarithmic(low, high):
    """Numbers between two powers of ten, each power as likely."""
    return st.floats(low, high).map(lambda power: 10.0**power)


@st.composite
def materials(draw):
    """Rocks, glasses and rubbers: stiffness of a bond and strength that fit the energy."""
    stiffness, strength = draw(logarithmic(9, 13)), draw(logarithmic(5, 8))
    least = strength**2 / (2.0 * stiffness)
    return Material(
        density=draw(logarithmic(2, 4)),
        normal_stiffness=stiffness,
        shear_stiffness=stiffness * draw(st.floats(0.05, 1.0)),
        normal_damping=draw(st.just(0.0) | logarithmic(3, 7)),
        shear_damping=draw(st.just(0.0) | logarithmic(3, 7)),
        tensile_strength=strength,
        cohesion=strength * draw(st.just(0.0) | st.floats(0.01, 3.0)),
        friction=draw(st.just(0.0) | st.floats(0.01, 2.0)),
        fracture_energy=least * draw(st.floats(1.1, 100.0)),
        contact_stiffness=draw(logarithmic(6, 10)),
        contact_damping=draw(st.just(0.0) | logarithmic(1, 6)),
    )


meshes = st.one_of(
    st.builds(single, logarithmic(-4, 2)),
    st.builds(pair, logarithmic(-4, 2)),
    st.builds(
        lambda size, cells: bar(size * cells[0], size * cells[1], cells),
        logarithmic(-4, 2),
        st.sampled_from([(1, 1, 1), (3, 1, 1), (2, 2, 1)]),
    ),
)


@settings(steady, max_examples=40)
@given(mesh=meshes, material=materials())
@pytest.mark.filterwarnings("error")
def test_reports_of_any_valid_mesh_and_material_are_numbers(mesh, material):
    """A body without bonds has no limit: infinite, but no NaN."""
    report, quality = step_report(mesh, material), quality_report(mesh, material)
    assert (report.step_s > 0.0).all()
    assert (quality.critical_step_s > 0.0).all()
    assert np.isfinite(quality.mass_kg).all()
    assert "nan" not in f"{report}{quality}"


def methods(step):
    """A method of each kind with a step [s]."""
    control = StepControl()
    return {
        "uniform": Uniform(step),
        "multirate": Multirate(8.0 * step, 1e-3, control=control),
        "limited": Multirate(step, 1e-3, "drifted", control, "limited"),
        "implicit": ImplicitDashpots(step),
    }


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in ("multirate", "limited", "implicit")]


@pytest.mark.parametrize("name", ["uniform", *SLOW])
def test_valid_scenes_run_and_stay_finite(name):
    """Twenty steps of a bar in one piece under gas and gravity, its left end held."""

    @settings(steady, max_examples=1)
    @given(material=materials(), peak=logarithmic(4, 8), size=logarithmic(-3, 1))
    def runs(material, peak, size):
        mesh = bar(2.0 * size, size, (2, 1, 1))
        step = 0.2 * float(step_report(mesh, material).step_s.min())
        listed = [effects.BondDamping(), effects.Softening(), effects.ShearSlip()]
        listed += [effects.SphereContact(skin=1e-2), effects.Friction(), effects.Gravity()]
        listed += [effects.Fixed("left"), effects.GasPressure("right", peak, 10.0 * step)]
        simulation = Simulation(Scene(mesh, material, listed), methods(step)[name])
        with ends_within(120.0):
            simulation.advance_to(20)
        account = simulation.energy_balance.account()
        assert all(np.isfinite(value) for value in account.values())
        motion = simulation.state.motion()
        assert np.isfinite(motion["position"]).all()
        assert np.isfinite(motion["velocity"]).all()

    runs()


@st.composite
def tables(draw, capacity, step):
    """Scenes of random numbers of particles, seeds, structures and bases; steps of step(f) [s]."""
    count = 6
    column = lambda numbers: [draw(numbers) for _ in range(count)]  # noqa: E731
    structures = [
        Oscillator(m, k, d * 2.0 * (k * m) ** 0.5, a)
        for m, k, d, a in zip(
            column(st.floats(0.05, 1.0)),
            column(st.floats(50.0, 500.0)),
            column(st.floats(0.001, 0.5)),
            column(st.just(0.0) | st.floats(1e-6, 1e-3)),
        )
    ]
    frequency = [draw(st.floats(0.5, 1.5)) * o.natural_frequency for o in structures]
    return SceneTable(
        column(st.integers(0, capacity)),
        column(st.integers(0, 2**31 - 1)),
        step,
        frequency,
        *([getattr(o, name) for o in structures] for name in ("base_amplitude", "mass")),
        *([getattr(o, name) for o in structures] for name in ("stiffness", "damping")),
    )


automata = st.builds(
    paper,
    accounting=st.sampled_from(["landing", "landing+ejection", "all"]),
    static_contact=st.none() | st.booleans(),
    restitution=st.floats(0.0, 1.0),
    wall_restitution=st.floats(0.0, 1.0),
    static_threshold=st.just(0.0) | st.floats(0.1, 10.0),
    columns=st.integers(1, 8),
    rows=st.integers(1, 8),
    gravity=st.just(0.0) | st.floats(0.1, 20.0),
    v_max=st.floats(3.0, 20.0),
)
spheres = st.builds(
    Spheres,
    damping=st.sampled_from(["tsuji", "printed"]),
    restitution=st.floats(0.3, 1.0),
    wall_restitution=st.floats(0.3, 1.0),
    friction=st.just(0.0) | st.floats(0.01, 1.0),
    young=logarithmic(6, 8),
    wall_young=logarithmic(6, 8),
    poisson=st.floats(0.0, 0.5),
    width=st.floats(6e-3, 30e-3),
    height=st.floats(12e-3, 40e-3),
    rotation=st.booleans(),
    search=st.sampled_from(["cells", "all_pairs"]),
)
FILLINGS = {
    "automaton": (automata, lambda filling: 1e-4),
    "spheres": (spheres, lambda filling: 0.5 * filling.safe_step()),
    "rigid": (st.builds(RigidMass, logarithmic(-6, -2), st.floats(0.1, 20.0)), lambda f: 1e-3),
}


@pytest.mark.parametrize("name", FILLINGS)
def test_valid_dampers_run_and_stay_finite(name):
    """A cycle of six scenes; those without damping or gravity too."""
    fillings, step = FILLINGS[name]

    @few
    @given(data=st.data())
    def runs(data):
        filling = data.draw(fillings)
        capacity = min(filling.capacity, 40)
        table = data.draw(tables(capacity, step(filling)))
        batch = Batch(filling, table)
        with expected(batch):
            batch.start(data.draw(st.sampled_from(["rest", "empty", "rigid"])))
        with ends_within(120.0):
            cycles = batch.run(0, 1)
        assert np.isfinite(cycles.record).all()
        assert all(np.isfinite(values).all() for values in batch.sample().values())

    runs()
