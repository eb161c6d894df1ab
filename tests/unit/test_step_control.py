"""No body takes a longer step than its springs, dashpots, motion and loads bear.

The limits of steps that a mesh is told to have are those of its motion as a whole.
"""

import dataclasses

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    read_mesh,
    step_report,
)
from taichi_dem.elasticity.rates import bond_rates, dashpots_of, largest_bond_rate, springs_of
from taichi_dem.mesh.shapes import bar, pair
from taichi_dem.mesh.topology import faces_of_group, topology_of
from taichi_dem.stability.body_limits import dashpot_limit, dashpot_step, spring_limit, spring_step
from taichi_dem.stability.step_report import stable_together
from taichi_dem.step_control import CRITERIA
from tests.closed_forms import LinearBonds


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


def test_steps_obey_the_limits_and_what_binds_is_recorded_and_counted():
    """Every body of the paper's block takes the longest dt0 / 2^k below a share of its limit."""
    dt0, block = 4e-6, read_mesh(PAPER_BLOCK)
    simulation = controlled(block, dt0, 1.0, group="hole")
    simulation.start()
    limit = 0.8 * step_report(simulation.scene).step_s
    step = dt0 / 2.0 ** simulation.values(simulation.state.level)[: block.body_count]
    assert np.all(step <= limit) and np.all(2.0 * step > limit)
    assert len(np.unique(step)) > 1
    assert simulation.report().bound_by == {"bond_dashpot": block.body_count}


@pytest.mark.parametrize(
    ("criterion", "dt0", "distance", "spin", "damping"),
    [
        ("displacement", 1e-5, 1e-9, 0.0, 1.0),
        ("rotation", 1e-5, 1.0, 1e6, 1.0),
        ("bond_dashpot", 1e-5, 1.0, 0.0, 1.0),
        ("bond_stiffness", 1e-5, 1.0, 0.0, 0.0),
        ("largest_step", 1e-8, 1.0, 0.0, 1.0),
    ],
)
def test_each_criterion_binds_where_it_is_the_shortest(criterion, dt0, distance, spin, damping):
    drags = {
        name: damping * getattr(CONCRETE, name) for name in ("normal_damping", "shear_damping")
    }
    material = dataclasses.replace(CONCRETE, **drags)
    simulation = controlled(bar(0.2, 0.1, (2, 1, 1)), dt0, distance, material=material)
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
    scene = Scene(pair(), CONCRETE, [effects.BondDamping()])
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


def test_kernels_and_arrays_share_the_formulas_of_the_stable_step():
    """Bit for bit, and both without a limit where nothing limits."""
    rates = np.concatenate([np.random.default_rng(4).uniform(0.0, 1e9, 200), [1e-30, 1e30]])
    found = np.zeros((len(rates), 2))

    @ti.kernel
    def limits(rates: ti.types.ndarray(ti.f64, 1), found: ti.types.ndarray(ti.f64, 2)):
        for k in range(rates.shape[0]):
            found[k, 0], found[k, 1] = dashpot_limit(rates[k]), spring_limit(rates[k])

    limits(rates, found)
    assert np.array_equal(found, np.column_stack([dashpot_step(rates), spring_step(rates)]))
    limits(np.zeros(len(rates)), found)
    assert found.min() > 1e90 and np.isinf([dashpot_step(0.0), spring_step(0.0)]).all()


@pytest.mark.parametrize(("law", "name"), [(dashpots_of, "damping"), (springs_of, "stiffness")])
@pytest.mark.parametrize("mesh", [pair(0.05, 0.02), bar(0.2, 0.05, (2, 1, 1))])
def test_largest_rate_of_the_whole_mesh_is_bounded_by_the_report(mesh, law, name):
    # |a - b|^2 <= 2 |a|^2 + 2 |b|^2 in every unit: the whole cannot be faster than twice its
    # fastest body; and it cannot be slower than that body between neighbours at rest.
    bonds, top = LinearBonds(mesh, CONCRETE), topology_of(mesh)
    fastest = bond_rates(mesh, top, CONCRETE.density, law(CONCRETE)).max()
    whole = bonds.largest_rate(getattr(bonds, name))
    assert fastest * (1.0 - 1e-9) <= whole <= 2.0 * fastest * (1.0 + 1e-9)
    # By LAPACK: both are backward stable, and differ by some units in the last place.
    given = mesh, top, CONCRETE.density, law(CONCRETE)
    assert abs(largest_bond_rate(*given) - fastest) <= 36 * np.finfo(float).eps * fastest
