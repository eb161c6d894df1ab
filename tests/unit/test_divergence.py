"""A run that leaves its bounds says where, when and which step would do, and keeps what it had."""

import re

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    quality_report,
    simulate,
)
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, single

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


def test_divergence_names_body_level_time_and_a_step(diverged):
    sentence = str(diverged[0])
    number = r"[0-9.]+(?:e-?\d+)?"
    assert re.search(rf"diverged at t = {number} s: body \d+ ", sentence)
    assert re.search(rf"its step was 1e-06 s \(level 0\), .* allow {number} s", sentence)
    assert "bond" in sentence and "\n" not in sentence


def test_the_step_it_advises_is_stable(diverged):
    """And the same run diverges no more: the residual stays small and the speed sane."""
    advised = float(re.search(r"try a step of ([0-9.e-]+) s", str(diverged[0])).group(1))
    assert diverged[0].advice == {"step": advised}
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
    times = error.result.history["time_s"]
    assert len(times) >= 1 and np.isfinite(error.result.history["kinetic_J"]).all()
    rows = (folder / "history.csv").read_text().splitlines()
    assert len(rows) == len(times) + 1
    assert "diverged at t" in (folder / "report.json").read_text()


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
    assert "inf" not in str(error) and "try a step" not in str(error)
    assert "the energy that it has was given to it: try a max_speed of 2e+03 m/s" in str(error)
    assert error.advice == {"max_speed": 2000.0}


def uneven_pair():
    """A body beside one a tenth as high, and the limits of its bond dashpots [s]."""
    points = pair().points.copy()
    points[4] *= 0.1
    mesh = checked_mesh(points, pair().tetrahedra, {})
    return mesh, quality_report(mesh, CONCRETE).dashpot_step_s


def test_the_tightest_limit_near_the_body_is_quoted_with_its_body():
    mesh, steps = uneven_pair()
    assert steps[1] < 0.2 * steps[0]
    error = refusal_of(mesh, [[200.0, 0.0, 0.0]] * 2, [effects.BondDamping()], 1e-6)
    assert "body 0 moves at" in str(error)
    assert f"the bond dashpots of body 1 beside it allow {steps[1]:.3g} s" in str(error)
    assert f"try a step of {0.5 * steps[1]:.2g} s" in str(error)
    assert error.advice["step"] == pytest.approx(0.5 * steps[1], rel=0.06)


def test_no_step_is_advised_that_is_longer_than_the_one_taken():
    """A step a hundred times below the limit is not to blame where the account closes."""
    mesh, steps = uneven_pair()
    error = refusal_of(mesh, [[200.0, 0.0, 0.0]] * 2, [effects.BondDamping()], 0.01 * steps[1])
    assert error.advice == {"max_speed": 2000.0}


@pytest.mark.parametrize("speed", [np.nan, np.inf, 1e200])
def test_a_motion_that_is_no_number_is_named_and_not_searched_with(speed):
    """Bodies in contact, one of them moving beyond all numbers: none is without a cell."""
    listed = [effects.BondDamping(), effects.SphereContact()]
    simulation = Simulation(Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, listed), Uniform(1e-8))
    simulation.start()
    simulation.state.velocity[3] = [speed, 0.0, 0.0]
    with pytest.raises(SimulationDiverged, match="body"):
        simulation.advance_to(20)
