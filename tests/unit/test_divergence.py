"""A run that leaves its bounds says where and what to try, keeps what it had, and is right."""

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Scene,
    Simulation,
    SimulationDiverged,
    Uniform,
    effects,
    simulate,
    step_report,
)
from taichi_dem.mesh.shapes import bar, placed_together
from tests.structures import filled

STEP, UNTIL = 1e-6, 2e-4


def run(step, output=None):
    """A small damped bar, pressed at its left end."""
    listed = filled("bonds", effects.BondDamping(), effects.GasPressure("left", 1e5, 1e-5))
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, listed)
    return simulate(scene, method=Uniform(step), until=UNTIL, samples=20, output=output)


@pytest.fixture(scope="module")
def diverged(tmp_path_factory):
    """The refusal of a step twenty times too large, and the folder of its output."""
    folder = tmp_path_factory.mktemp("diverged")
    with pytest.warns(UserWarning, match="bonds"), pytest.raises(SimulationDiverged) as refusal:
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


def test_what_is_above_its_limit_is_named_before_what_flies():
    """A bar whose springs the step is too long for, beside a block that flies and is calm."""
    block, slender = bar(0.4, 0.1, (4, 1, 1)), bar(0.3, 0.05, (6, 1, 1))
    mesh = placed_together({"block": (block, (0, 0, 0)), "bar": (slender, (0, 0.5, 0))})
    velocity = np.zeros((mesh.body_count, 3))
    velocity[: block.body_count, 2] = 50.0
    velocity[block.body_count, 0] = 0.1
    listed = filled("bonds", effects.BondDamping(), group="block_left")
    scene = Scene(mesh, CONCRETE, listed, velocity=velocity)
    limits = step_report(scene).limits["bond_dashpot"]
    limit = limits[block.body_count :].min()
    assert 1.4 * limit < limits[: block.body_count].min()
    with pytest.warns(UserWarning), pytest.raises(SimulationDiverged) as refusal:
        simulate(scene, method=Uniform(1.4 * limit), until=1e-4, progress=None)
    words, above = str(refusal.value), np.flatnonzero(limits < 1.4 * limit)
    first = int(words.split("body ")[1].split()[0])
    assert first in above and first >= block.body_count
    assert words.index(f"{limit:.3g} s") < words.rindex("body ")
    assert refusal.value.advice["step"] <= limit


def test_an_idle_scene_does_not_diverge_however_long_it_rests():
    """The energy that rounding gives it grows with the steps, and stays round-off."""
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, filled("bonds", effects.BondDamping()))
    report = simulate(scene, method=Uniform(1e-8), until=1e-4, samples=4, progress=None).report
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


def test_a_motion_that_is_no_number_is_named_and_not_searched_with():
    """Bodies in contact, one of them moving beyond all numbers: none is without a cell."""
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, [effects.SphereContact()])
    simulation = Simulation(scene, Uniform(1e-8))
    simulation.start()
    simulation.state.velocity[3] = [np.nan, 0.0, 0.0]
    with pytest.raises(SimulationDiverged, match="body"):
        simulation.advance_to(20)
