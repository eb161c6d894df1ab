"""Contact of bodies of different sizes, that hit fast, slide over edges, or begin in each other."""

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, Simulation, SimulationDiverged, Uniform, effects
from taichi_dem.mesh.shapes import bar, placed_together, single
from taichi_dem.simulate import run_simulation
from tests.turns import matrix, quaternion
from tests.verification.test_body_contact import LOSSLESS, Placed

EDGE, SPEED = 0.05, 200.0
X, DOWN = np.array([1.0, 0.0, 0.0]), quaternion([0.0, 0.0, 1.0], -0.5 * np.pi)
INRADIUS = EDGE / 24**0.5


@pytest.mark.parametrize("size", [0.1, 1.0])
def test_a_small_body_on_a_large_face_has_the_energy_of_its_own_face(size):
    """Wherever it lies: the rays of the large body are far apart."""
    placed, depth = Placed(bar(size, size, (1, 1, 1)), single(EDGE)), 1e-5
    flat = 0.5 * CONCRETE.normal_stiffness * 0.25 * 3**0.5 * EDGE**2 * depth**2
    for x, z in np.random.default_rng(1).uniform(0.35, 0.65, (12, 2)):
        placed.put([x * size, size + INRADIUS - depth, z * size], DOWN)
        assert placed.energy() == pytest.approx(flat, rel=0.01)


def test_the_force_is_continuous_where_a_body_slides_over_an_edge():
    """A hundredth of a micrometre changes it by less than 1e-4."""
    placed, forces = Placed(bar(0.2, 0.2, (2, 2, 2)), single(EDGE)), []
    for way in np.arange(-200, 200) * 1e-8:
        placed.put([0.1 + way, 0.2 + INRADIUS - 3e-4, 0.083], DOWN)
        forces.append(placed.simulation.readings.contacts_now()[:, 6:9].sum(axis=0))
    step = np.linalg.norm(np.diff(forces, axis=0), axis=1)
    assert step.max() < 1e-4 * np.linalg.norm(forces, axis=1).max()


def run(parts, until, turn=(1.0, 0.0, 0.0, 0.0), velocity=0.0):
    """Report of a run of bodies, and their motion at its end."""
    scene = Scene(placed_together(parts), LOSSLESS, [effects.BodyContact()])
    simulation = Simulation(scene, Uniform(1e-7))
    simulation.state.set_motion(simulation.model.centre, turn, velocity)
    return run_simulation(simulation, until=until, progress=None).report, simulation.motion()


def test_none_passes_another_that_it_hits_at_200_m_s():
    """Sixty aims at bodies of any orientation, most of them vertex or edge first."""
    random, parts = np.random.default_rng(0), {}
    turn = random.standard_normal((120, 4))
    turn /= np.linalg.norm(turn, axis=1)[:, None]
    for k in range(60):
        corners = single(EDGE).points - single(EDGE).points.mean(axis=0)
        aim = matrix(turn[2 * k]) @ (random.dirichlet(np.ones(4)) @ corners)
        at = np.array([0.0, 0.0, k])
        shot = at + aim * [0.0, 1.0, 1.0] - 1.25 * EDGE * X
        parts |= {f"at{k}": (single(EDGE), at), f"shot{k}": (single(EDGE), shot)}
    report, motion = run(parts, 3.0 * EDGE / SPEED, turn, np.outer(np.arange(120) % 2, SPEED * X))
    apart, away = (motion[name][1::2] - motion[name][::2] for name in ("position", "velocity"))
    assert 0.01 < report.interpenetration.share < 0.1
    assert abs(report.energy_residual_fraction) < 1e-3
    assert (np.einsum("ni,ni->n", apart, away) > 0.0).all()


def test_bodies_that_begin_in_each_other_get_no_energy_and_are_refused_beyond_a_half():
    """Their overlap at the start is that at rest."""
    first = {"first": (single(EDGE), 0.0 * X)}
    report, motion = run({**first, "second": (single(EDGE), 0.01 * X)}, 1e-4)
    assert np.abs(motion["velocity"]).max() == report.energy_balance["injected"] == 0.0
    with pytest.raises(SimulationDiverged, match="body 0 shares"):
        run({**first, "second": (single(EDGE), 0.001 * X)}, 1e-4)
