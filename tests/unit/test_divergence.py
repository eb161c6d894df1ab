"""A run that leaves its bounds says where and what to try, keeps what it had, and is right."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from ca_damper import SimulationDiverged as DamperDiverged
from taichi_dem import (
    CONCRETE,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    simulate,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.stability.step_report import bond_steps

STEP, UNTIL = 1e-6, 2e-4


def run(step, output=None):
    """A small damped bar, pressed at its left end."""
    listed = [effects.BondDamping(), effects.GasPressure("left", peak=1e5, rise=1e-5)]
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, listed)
    return simulate(scene, method=Uniform(step), until=UNTIL, samples=20, output=output)


@pytest.fixture(scope="module")
def diverged(tmp_path_factory):
    """The refusal of a step twenty times too large, and the folder of its output."""
    folder = tmp_path_factory.mktemp("diverged")
    with pytest.raises(SimulationDiverged) as refusal:
        run(STEP, str(folder))
    return refusal.value, folder


def test_the_step_it_advises_is_stable(diverged):
    """And the same run diverges no more: the residual stays small and the speed sane."""
    advised = diverged[0].advice["step"]
    assert advised < STEP
    report = run(advised).report
    assert report.until_s >= UNTIL * (1.0 - 1e-9)
    # First order in step times fastest rate, which the advice keeps at 1.
    assert report.energy_residual_fraction < 1.0
    assert np.isfinite(report.energy_balance["kinetic"])
    assert report.energy_balance["kinetic"] <= report.energy_balance["load_work"]


def test_an_idle_scene_does_not_diverge_however_long_it_rests():
    """The energy that rounding gives it grows with the steps, and stays round-off."""
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [effects.Fixed("left")])
    report = simulate(scene, method=Multirate(), until=1e-3, samples=4, progress=None).report
    assert 0.0 < report.energy_balance["kinetic"] < report.round_off_J
    assert "round-off" in report.unexplained


def test_a_diverged_run_leaves_its_last_good_output(diverged):
    error, folder = diverged
    assert error.result.diverged == str(error)
    times = error.result.series["time_s"]
    assert len(times) >= 1 and np.isfinite(error.result.series["kinetic_J"]).all()
    rows = (folder / "history.csv").read_text().splitlines()
    assert len(rows) == len(times) + 1
    assert "diverged at t" in (folder / "report.json").read_text()


def test_it_reaches_another_process_with_its_advice():
    for error in (
        refusal_of(single(), [[200.0, 0.0, 0.0]]),
        DamperDiverged(
            "it diverged", scene={"seed": 3}, step=7, time_s=0.1, dt=1e-3, dt_allowed=1e-4
        ),
    ):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error)
        assert vars(again) == vars(error) and dict(again.advice) == dict(error.advice)


def refusal_of(mesh, velocity, listed=(), step=1e-10):
    """What becomes of bodies that exceed 100 m/s."""
    simulation = Simulation(Scene(mesh, CONCRETE, list(listed), max_speed=100.0), Uniform(step))
    simulation.state.set_motion(
        simulation.model.centre, [[1.0, 0, 0, 0]] * mesh.body_count, velocity
    )
    with pytest.raises(SimulationDiverged) as refusal:
        simulation.advance_to(1)
    return refusal.value


def test_a_body_without_bonds_has_no_limit_to_quote():
    """It was given its speed, so that no step would change it."""
    error = refusal_of(single(), [[200.0, 0.0, 0.0]])
    assert "inf" not in str(error)
    assert error.advice == {"max_speed": 2000.0}


def uneven_pair():
    """A body beside one a tenth as high, and the limits of its bond dashpots [s]."""
    points = pair().points.copy()
    points[4] *= 0.1
    mesh = checked_mesh(points, pair().tetrahedra, {})
    return mesh, bond_steps(mesh, CONCRETE)["bond_dashpot"]


def test_the_tightest_limit_near_the_body_is_quoted_with_its_body():
    mesh, steps = uneven_pair()
    assert steps[1] < 0.2 * steps[0]
    error = refusal_of(mesh, [[200.0, 0.0, 0.0]] * 2, [effects.BondDamping()], 1e-6)
    assert "body 0 moves at" in str(error)
    assert f"the bond dashpots of body 1 beside it allow {steps[1]:.3g} s" in str(error)
    assert error.advice["step"] == pytest.approx(0.5 * steps[1], rel=0.06)


def test_no_step_is_advised_that_is_longer_than_the_one_taken():
    """A step a hundred times below the limit is not to blame where the account closes."""
    mesh, steps = uneven_pair()
    error = refusal_of(mesh, [[200.0, 0.0, 0.0]] * 2, [effects.BondDamping()], 0.01 * steps[1])
    assert error.advice == {"max_speed": 2000.0}


def test_a_motion_that_is_no_number_is_named_and_not_searched_with():
    """Bodies in contact, one of them moving beyond all numbers: none is without a cell."""
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, [effects.SphereContact()])
    simulation = Simulation(scene, Uniform(1e-8))
    simulation.start()
    simulation.state.velocity[3] = [np.nan, 0.0, 0.0]
    with pytest.raises(SimulationDiverged, match="body"):
        simulation.advance_to(20)


def shot(contact, speed, samples, stiffness, step):
    """Run of a body that flies at a pair [m/s], whose contacts are so stiff, in the law's unit."""
    constants = dict(zip(contact.constants, (stiffness, 0.0)))
    soft = replace(CONCRETE, fracture_energy=1e12, **constants)
    parts = {"flying": (single(), (-1e-4, 0.0, 0.0)), "pair": (pair(), (0.05, 0, 0))}
    moves = {"velocity": {"flying": (speed, 0.0, 0.0)}}
    scene = Scene(placed_together(parts), soft, [contact], **moves)
    asked = {"until": 0.1 / speed, "samples": samples, "progress": None}
    return simulate(scene, method=Uniform(step), **asked)


@pytest.mark.parametrize(
    ("contact", "speed", "samples", "stiffness"),
    [(effects.SphereContact(), 50.0, 10, 1e3), (effects.BodyContact(), 500.0, 1, 1e9)],
)
def test_the_stiffness_it_advises_ends_well(contact, speed, samples, stiffness):
    """Spheres of 5 mm hold 44 J a body only from 1e6 N/m on: six spheres, k (2 mm)^2 / 2 each.

    Bodies that pass each other between two samples are found too.
    """
    given, advised = {contact.constants[0]: stiffness, "step": 2e-7}, []
    while len(advised) < 6:
        try:
            account = dict(shot(contact, speed, samples, *given.values()).report.energy_balance)
            break
        except SimulationDiverged as error:
            given |= error.advice
            advised += error.advice
    assert contact.constants[0] in advised
    assert abs(account.pop("residual")) <= 0.5 * sum(map(abs, account.values()))
