"""No body takes a longer step than its springs, dashpots, motion and loads bear.

A run that leaves its bounds says where and what to try, keeps what it had, and is right.
"""

import dataclasses

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    Multirate,
    Scene,
    Simulation,
    SimulationDiverged,
    StepControl,
    Uniform,
    effects,
    read_mesh,
    simulate,
    step_report,
)
from taichi_dem.elasticity.rates import bond_rates, largest_bond_rate, springs_of
from taichi_dem.mesh.shapes import bar, pair, placed_together
from taichi_dem.mesh.topology import faces_of_group, topology_of
from taichi_dem.stability.body_limits import dashpot_step, spring_step
from taichi_dem.stability.step_report import stable_together
from taichi_dem.step_control import CRITERIA
from tests.structures import filled


def multiplier(dt, stiffness, damping):
    """Largest growth a step of the leapfrog v += -dt (k x + c v), x += dt v of a unit mass."""
    kept = 1.0 - dt * damping
    step = [[kept, -dt * stiffness], [dt * kept, 1.0 - dt**2 * stiffness]]
    return np.abs(np.linalg.eigvals(step)).max()


@pytest.mark.parametrize("ratio", [1e-3, 0.1, 0.7, 1.0, 2.0, 30.0])
def test_springs_and_dashpots_together_are_stable_up_to_the_step_that_is_told(ratio):
    """Of a pair of equal bodies, whose rates are twice those of one; ratio: of both steps alone."""
    rate2 = 3.0
    springs = float(spring_step(rate2))
    rate = float(dashpot_step(1.0)) / (ratio * springs)
    told = stable_together(springs, dashpot_step(rate))
    assert multiplier(0.999 * told, 2.0 * rate2, 2.0 * rate) <= 1.0 + 1e-12
    assert multiplier(1.001 * told, 2.0 * rate2, 2.0 * rate) > 1.0
    assert told < min(springs, float(dashpot_step(rate)))


def controlled(mesh, dt0, distance, *, peak=1.0, group="left", material=CONCRETE):
    """A damped solid under gas, with steps of its bodies' own."""
    listed = [effects.BondDamping(), effects.GasPressure(group, peak=peak, rise=1e-6)]
    method = Multirate(dt0, distance, control=StepControl(safety=0.8, level_jump=None))
    return Simulation(Scene(mesh, material, listed), method)


UNDAMPED = dataclasses.replace(CONCRETE, normal_damping=0.0, shear_damping=0.0)


@pytest.mark.parametrize(
    ("criterion", "dt0", "material"),
    [("bond_dashpot", 4e-6, CONCRETE), ("bond_stiffness", 6.4e-5, UNDAMPED)],
)
def test_steps_obey_the_limits_and_what_binds_is_recorded(criterion, dt0, material):
    """Every body of the paper's block takes the longest dt0 / 2^k below a share of its limit."""
    block = read_mesh(PAPER_BLOCK)
    simulation = controlled(block, dt0, 1.0, group="hole", material=material)
    simulation.start()
    limit = 0.8 * step_report(simulation.scene).step_s
    step = dt0 / 2.0 ** simulation.values(simulation.state.level)[: block.body_count]
    assert np.all(step <= limit) and np.all(2.0 * step > limit)
    assert len(np.unique(step)) > 1
    assert simulation.report().bound_by == {criterion: block.body_count}


@pytest.mark.parametrize(
    ("criterion", "dt0", "distance", "spin"),
    [
        ("displacement", 1e-5, 1e-9, 0.0),
        ("rotation", 1e-5, 1.0, 1e6),
        ("largest_step", 1e-8, 1.0, 0.0),
    ],
)
def test_each_criterion_binds_where_it_is_the_shortest(criterion, dt0, distance, spin):
    simulation = controlled(bar(0.2, 0.1, (2, 1, 1)), dt0, distance)
    velocity, turning = [0.1, 0.0, 0.0], [spin, 0.0, 0.0]
    simulation.state.set_motion(simulation.model.centre, None, velocity, turning)
    simulation.start()
    assert simulation.report().bound_by == {criterion: 12}


def test_load_criterion_looks_a_largest_step_ahead():
    """F / m dt^2 <= l for the force of the coming step, though the pulse starts at t = 0."""
    distance, peak, dt0 = 1e-11, 1e6, 1e-6
    simulation = controlled(bar(0.4, 0.1, (4, 1, 1)), dt0, distance, peak=peak)
    simulation.start()
    model = simulation.model
    loaded = np.unique(faces_of_group(model.mesh, model.topology, "left")[0])
    assert np.all(simulation.values(simulation.state.bound)[loaded] == CRITERIA.index("load"))
    force = peak * 0.1 * 0.1 / 2
    expected = np.sqrt(distance * model.body_mass[loaded] / force)
    step = dt0 / 2.0 ** simulation.values(simulation.state.level)[loaded]
    assert np.all(step <= expected) and np.all(2.0 * step > expected)


@pytest.mark.parametrize(("dt", "is_less"), [(1e-7, False), (2e-6, True)])
def test_limited_dashpots_take_the_share_that_the_step_bears_and_name_it(dt, is_less):
    """1 - s rate dt in a step, s = min(1, 1.7 / X) with X = 2 dt lambda of the 6x6 bond block.

    A run begins half a step back: the step ends at 1 - s rate dt / 2, of the velocity at zero.
    """
    scene = Scene(pair(), CONCRETE, filled("bonds", effects.BondDamping()))
    simulation = Simulation(scene, Uniform(dt, dashpot="limited"))
    apart = [[-1e-3, 0.0, 0.0], [1e-3, 0.0, 0.0]]
    simulation.state.set_motion(simulation.model.centre, velocity=apart)
    simulation.advance_to(1)
    simulation.sample()
    factor = 2.0 * simulation.state.velocity[0][0] / -1e-3 - 1.0
    rate = 6.0 * simulation.tables.unit_area[0] * CONCRETE.normal_damping
    rate /= simulation.model.body_mass[0]
    share = min(1.0, 1.7 / (2.0 * dt * simulation.schedule.limits.bond_damping[0]))
    assert (share < 1.0) == is_less
    assert factor == pytest.approx(1.0 - share * rate * dt, rel=1e-9)
    assert -1.0 < factor
    said = f"bond 0 to {100 * share:.2g} %"
    findings = simulation.followed.step_resolution.findings()
    assert [said in finding for finding in findings] == [True] * is_less


def test_the_largest_rate_of_a_mesh_is_that_of_its_fastest_body():
    """By LAPACK and without: both are backward stable, and differ by units in the last place."""
    mesh = bar(0.2, 0.05, (2, 1, 1))
    given = mesh, topology_of(mesh), CONCRETE.density, springs_of(CONCRETE)
    rounding = 36 * np.finfo(float).eps
    assert largest_bond_rate(*given) == pytest.approx(bond_rates(*given).max(), rel=rounding)


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
    # First order in step times fastest rate, which the advice keeps at 1.
    assert report.energy_residual_fraction < 1.0
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
    touch = filled("bodies", effects.BodyContact(outer_faces=True), group="right")
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, touch)
    simulation = Simulation(scene, Uniform(1e-8))
    simulation.start()
    simulation.state.velocity[3] = [np.nan, 0.0, 0.0]
    with pytest.raises(SimulationDiverged, match="body"):
        simulation.advance_to(20)
