"""What limits a step: options, the report before a run, what a run records, limited dashpots."""

import re

import numpy as np
import pytest
import taichi as ti

from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    InputError,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    checked_mesh,
    effects,
    read_mesh,
    simulate,
    step_report,
)
from taichi_dem.mesh.shapes import bar, pair, single
from taichi_dem.mesh.topology import faces_of_group, topology_of
from taichi_dem.stability.body_limits import LIMITED
from taichi_dem.stability.mesh_limits import (
    bond_rates,
    dashpots_of,
    subset_rates,
)
from taichi_dem.stability.stable_step import (
    dashpot_limit,
    dashpot_step,
    spring_limit,
    spring_step,
)
from taichi_dem.stability.step_control import CRITERIA
from taichi_dem.stability.step_report import StepReport, stable_together


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: StepControl(safety=0.0),
        lambda: StepControl(safety=1.5),
        lambda: StepControl(angle="much"),
        lambda: StepControl(criteria=("colour",)),
        lambda: StepControl(wake=("noise",)),
        lambda: StepControl(level_jump=-1),
        lambda: StepControl(ahead=0.5),
        lambda: Multirate(control=StepControl(dashpot_floor=1e-8)),
        lambda: Uniform(dashpot="half"),
        lambda: Multirate(control="all"),
        lambda: step_report(pair()),
    ],
)
def test_wrong_options_are_refused_in_a_sentence(wrong):
    with pytest.raises(InputError, match=r"must be|needs"):
        wrong()


def test_report_names_the_limit_of_each_element_and_what_the_worst_cost():
    """A bar with spheres of six a face: its contact dashpots bind; without them its bonds'."""
    mesh = bar(0.4, 0.1, (4, 1, 1))
    report = step_report(mesh, CONCRETE)
    assert set(report.binding) == {"contact_dashpot"}
    assert np.all(report.limits["contact_dashpot_single"] > report.limits["contact_dashpot"])
    bonded = step_report(Scene(mesh, CONCRETE, [effects.BondDamping()]))
    assert set(bonded.binding) == {"bond_dashpot"} and set(bonded.limits) == {
        "bond_stiffness",
        "bond_dashpot",
    }
    rates = bond_rates(mesh, topology_of(mesh), CONCRETE.density, dashpots_of(CONCRETE))
    assert np.array_equal(bonded.step_s, dashpot_step(rates))
    steps = np.sort(bonded.step_s)
    assert bonded.price(10) == pytest.approx(steps[10] / steps[0])
    assert bonded.work_share(10) == pytest.approx((1 / steps[:10]).sum() / (1 / steps).sum())
    assert "bond_dashpot" in str(bonded) and str(bonded.worst()[0]) in str(bonded)


def multiplier(dt, stiffness, damping):
    """Largest growth a step of the leapfrog v += -dt (k x + c v), x += dt v of a unit mass."""
    step = np.array(
        [
            [1.0 - dt * damping, -dt * stiffness],
            [dt * (1.0 - dt * damping), 1.0 - dt**2 * stiffness],
        ]
    )
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


@pytest.mark.parametrize("share", [1e-3, 0.5, 0.8, 0.9, 10.0])
def test_limited_dashpots_leave_the_springs_what_they_do_not_take(share):
    """They keep min(1, LIMITED / X) of themselves, X = 2 dt rate; share: of the springs' step."""
    rate2 = 3.0
    springs = float(spring_step(rate2))
    drags = share * springs
    told = StepReport({"bond_stiffness": np.array([springs]), "bond_dashpot": np.array([drags])})
    (step,) = told.borne("limited")

    def growth(dt):
        return multiplier(dt, 2.0 * rate2, min(2.0 / drags, LIMITED / dt))

    assert all(growth(part * step) <= 1.0 + 1e-12 for part in (0.1, 0.5, 0.9, 0.999))
    assert growth(1.01 * step) > 1.0


def test_report_tells_what_each_method_bears():
    """Solved dashpots leave the springs; without contact bonds limit, without bonds nothing."""
    mesh = bar(0.4, 0.1, (4, 1, 1))
    report = step_report(mesh, CONCRETE)
    for link in ("bond", "contact"):
        solved, limited, full = (report.borne(way, link) for way in ("solved", "limited", "full"))
        assert np.array_equal(solved, report.limits[f"{link}_stiffness"])
        assert np.all(full < report.limits[f"{link}_dashpot"])
        assert np.all(full < limited) and np.all(limited < solved)
    lines = {line[:32].strip(): line[32:].split() for line in str(report).splitlines()}
    assert lines["Uniform, Multirate"][1::2] == ["dashpots", "dashpots"]
    told = [float(word) for word in lines["ImplicitDashpots"][::2]]
    smallest = [report.borne("solved", link).min() for link in ("bond", "contact")]
    assert told == pytest.approx(smallest, rel=5e-3)
    assert lines["ImplicitDashpots"][1::2] == ["springs", "springs"]
    undamped = step_report(Scene(mesh, CONCRETE))
    for way in ("full", "limited", "solved"):
        assert np.allclose(undamped.borne(way), report.limits["bond_stiffness"], rtol=1e-15)
        assert np.isinf(undamped.borne(way, "contact")).all()


def loose_and_bonded(*meshes):
    """Meshes side by side in one, 1 m apart."""
    starts = np.cumsum([0] + [mesh.point_count for mesh in meshes])
    points = [np.add(mesh.points, [0.0, 0.0, place]) for place, mesh in enumerate(meshes)]
    bodies = [mesh.tetrahedra + start for mesh, start in zip(meshes, starts)]
    return checked_mesh(np.vstack(points), np.vstack(bodies), {})


@pytest.mark.parametrize("count", [1, 3, 12])
@pytest.mark.parametrize("listed", [[], [effects.BondDamping()], [effects.Gravity()]])
def test_bodies_without_bonds_are_told_that_nothing_limits_their_step(count, listed):
    """No figure is said of them: there is no step, no share and no gain to tell."""
    scene = Scene(loose_and_bonded(*[single()] * count), CONCRETE, listed)
    report = step_report(scene)
    assert set(report.binding) == {"nothing"}
    first = str(report).splitlines()[0]
    assert first == "nothing limits the step: no body has a bond, and no contact is listed"
    assert not re.search(r"\binf\b|nan|%|times|bond_", str(report) + repr(report))
    assert "nothing limits the step" in repr(report)


@pytest.mark.parametrize("loose", [0, 1, 20])
def test_bodies_that_nothing_limits_are_not_among_the_worst(loose):
    """Two bonded bodies limit the step of all; without them nothing is left to compare with."""
    mesh = loose_and_bonded(*[single()] * loose, pair())
    report = step_report(Scene(mesh, CONCRETE, [effects.BondDamping()]))
    assert list(report.binding) == ["nothing"] * loose + ["bond_dashpot"] * 2
    told = str(report)
    assert told.count("  bond_dashpot\n") + told.endswith("  bond_dashpot") == 2
    assert not re.search(r"\binf\b|nan|times longer|  nothing", told)
    assert ("unlimited" in told) and ("s by bond_dashpot" in repr(report))


def test_equal_worst_bodies_do_not_promise_a_step_one_time_longer():
    report = step_report(Scene(loose_and_bonded(*[pair()] * 6), CONCRETE, [effects.BondDamping()]))
    assert "the step of all would be no longer; with steps of their own" in str(report)


def test_a_body_that_lost_bonds_is_as_slow_as_those_that_hold():
    """Fewer bonds never make a body faster; none make it free."""
    mesh = bar(0.2, 0.1, (2, 1, 1))
    rates = subset_rates(mesh, topology_of(mesh), CONCRETE.density, dashpots_of(CONCRETE))
    assert np.all(rates[:, 0] == 0.0)
    for subset in range(16):
        for more in (subset | 1 << f for f in range(4)):
            assert np.all(rates[:, subset] <= rates[:, more] * (1 + 1e-12))


def damped_block():
    """The paper's block, elements of many sizes, damped and pressed at its hole."""
    return Scene(read_mesh(PAPER_BLOCK), CONCRETE, [effects.BondDamping(), effects.GasPressure()])


def test_steps_obey_the_limits_and_what_binds_is_recorded_counted_and_drawn(tmp_path):
    """Every body takes the longest dt0 / 2^k below a share of its limit; its cause is kept."""
    dt0 = 4e-6
    control = StepControl(safety=0.8, level_jump=None)
    method = Multirate(dt0, 1.0, control=control)
    result = simulate(damped_block(), method=method, until=4e-6, frames=1, output=str(tmp_path))
    limit = 0.8 * step_report(damped_block()).step_s
    step = dt0 / 2.0 ** result.frames[-1].level
    assert np.all(step <= limit) and np.all(2.0 * step > limit)
    assert len(np.unique(step)) > 1
    assert set(result.frames[-1].bound) == {CRITERIA.index("bond_dashpot")}
    assert result.report.bound_by == {"bond_dashpot": result.model.body_count}
    assert "bond dashpot" in str(result.report)
    assert "step_bound_by" in next((tmp_path / "paraview").glob("*_0000.vtu")).read_text()


@pytest.mark.parametrize(
    "criterion, options, spin",
    [
        ("displacement", {"distance": 1e-8}, 0.0),
        ("rotation", {"distance": 1.0}, 1e6),
        ("bond_stiffness", {"distance": 1.0}, 0.0),
        ("largest_step", {"distance": 1.0, "dt0": 1e-8}, 0.0),
    ],
)
def test_each_criterion_binds_where_it_is_the_shortest(criterion, options, spin):
    method = Multirate(**{"dt0": 1e-5, "control": StepControl(), **options})
    simulation = Simulation(Scene(pair(), CONCRETE), method)
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    velocity = np.tile([0.1, 0.0, 0.0], (2, 1))
    turning = np.tile([spin, 0.0, 0.0], (2, 1))
    simulation.state.set_motion(simulation.model.centre, still, velocity, turning)
    simulation.start()
    assert simulation.report().bound_by == {criterion: 2}


def test_load_criterion_looks_a_largest_step_ahead():
    """F / m dt^2 <= l for the force of the coming step, though the pulse starts at t = 0."""
    distance, peak = 1e-9, 1e6
    listed = [effects.GasPressure("left", peak=peak, rise=1e-6)]
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, listed)
    control = StepControl(level_jump=None)
    simulation = Simulation(scene, Multirate(1e-6, distance, control=control))
    simulation.start()
    mesh, topology = simulation.model.mesh, simulation.model.topology
    loaded = np.unique(faces_of_group(mesh, topology, "left")[0])
    bound = simulation.state.bound.to_numpy()
    assert np.all(bound[loaded] == CRITERIA.index("load"))
    area = 0.1 * 0.1 / 2
    force = peak * area
    expected = np.sqrt(distance * simulation.model.body_mass[loaded] / force)
    step = 1e-6 / 2.0 ** simulation.state.level.to_numpy()[loaded]
    assert np.all(step <= expected) and np.all(2.0 * step > expected)


def decay_in_a_step(dt, dashpot):
    """Factor of the normal velocity of a bonded pair in its first step, springs apart.

    A run begins half a step back: the step ends at 1 - s rate dt / 2, of the velocity at zero.
    """
    simulation = Simulation(
        Scene(pair(), CONCRETE, [effects.BondDamping()]), Uniform(dt, None, None, dashpot)
    )
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
    velocity = np.array([[-1e-3, 0.0, 0.0], [1e-3, 0.0, 0.0]])
    simulation.state.set_motion(simulation.model.centre, still, velocity)
    simulation.advance_to(1)
    rate = 2.0 * 3.0 * simulation.tables.unit_area[0] * CONCRETE.normal_damping
    fastest = simulation.schedule.limits.bond_damping[0] if dashpot == "limited" else 0.0
    return (
        2.0 * simulation.state.velocity[0][0] / -1e-3 - 1.0,
        rate / simulation.model.body_mass[0],
        fastest,
    )


def test_limited_dashpots_take_the_share_that_the_step_bears():
    """1 - s rate dt in a step, s = min(1, 1.7 / X) with X = 2 dt lambda of the 6x6 bond block."""
    for dt in (1e-7, 2e-6):
        factor, rate, fastest = decay_in_a_step(dt, "limited")
        share = min(1.0, 1.7 / (2.0 * dt * fastest))
        assert (share < 1.0) == (dt > 1e-6)
        assert factor == pytest.approx(1.0 - share * rate * dt, rel=1e-9)
        assert -1.0 < factor
    full, rate, _ = decay_in_a_step(1e-7, "full")
    assert full == decay_in_a_step(1e-7, "limited")[0]


class OwnContact(effects.SphereContact):
    """A contact law by another name."""

    name = "own_contact"


class OwnDamping(effects.BondDamping):
    """A dashpot by another name."""

    name = "own_damping"


def test_the_step_report_asks_for_effects_by_role():
    """Not by name: laws of one's own lose no criterion."""
    package = [effects.BondDamping(), effects.SphereContact(), effects.Friction()]
    own = [OwnDamping(), OwnContact(), effects.StickingFriction()]
    first, second = (step_report(Scene(pair(), CONCRETE, laws)).limits for laws in (package, own))
    assert set(first) == set(second) and len(first) == 5
    for name, limits in first.items():
        assert np.array_equal(limits, second[name])


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
