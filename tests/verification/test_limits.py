"""Stability limits of the explicit step, found by bisection and compared with their formulas."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
import taichi as ti

from cases.closed_forms import LinearBonds, carried
from taichi_dem import (
    CONCRETE,
    PAPER_BLOCK,
    ImplicitDashpots,
    Multirate,
    Scene,
    Simulation,
    StepControl,
    Uniform,
    effects,
    read_mesh,
    simulate,
    step_report,
)
from taichi_dem.elasticity.rates import (
    bond_bounds,
    bond_rates,
    contact_bounds,
    contact_eigenvalues,
    dashpots_of,
    springs_of,
)
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.mesh import checked_mesh
from taichi_dem.mesh.shapes import bar, pair, placed_together, single
from taichi_dem.mesh.topology import topology_of
from taichi_dem.stability.body_limits import FOR_CONTACTS, LIMITED, dashpot_step, spring_step
from taichi_dem.state.timeline import MACRO_TICKS, MAX_LEVEL
from tests.structures import POST, filled

STILL = np.tile([1.0, 0.0, 0.0, 0.0], (2, 1))
#: Steps of a run that must grow: at 1.004 of a limit a mode grows by 1.008 a step, 1e10 in all.
STEPS = 3000
HALVINGS = 9


class Rig:
    """A scene of two bodies that is run again and again with other steps, compiled once."""

    def __init__(self, mesh, listed, method=None, material=CONCRETE):
        self.simulation = Simulation(Scene(mesh, material, listed), method or Uniform(1e-9))
        self.simulation.start()
        self.state, self.centre = self.simulation.state, self.simulation.model.centre
        if self.simulation.contacts is not None:
            # Spheres on the bases alone: those of other faces would touch there too.
            assign(self.state.exposed_tick, [0, -1, -1, -1] * 2)

    def speeds(self, step, steps, position, velocity, spin):
        """Root of the sum of squared speeds after some steps of a length [s]."""
        assign(self.simulation.schedule.step_seconds, step / 2.0 ** np.arange(MAX_LEVEL + 1))
        self.state.set_motion(position, STILL, velocity, spin)
        assign(self.state.slot, 0.0)
        self.state.tick[None] = 0
        assign(self.state.last_tick, 0)
        self.simulation.driver.begin()
        if self.simulation.contacts is not None:
            self.simulation.broad_phase.search()
        while self.state.tick[None] < steps * MACRO_TICKS:
            self.simulation.driver.run(steps * MACRO_TICKS)
            if self.state.bad_body[None] < 2:
                self.state.bad_body[None] = 2
                return np.inf
        return np.linalg.norm(self.state.motion()["velocity"])


def bisected(stable, low, high):
    """Largest stable step between a stable and an unstable one, to 2^-HALVINGS of their gap."""
    assert stable(low) and not stable(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    return 0.5 * (low + high)


def grown(rig, seed):
    """A test whether tiny random motion of a bonded pair stays small at a step."""
    random = np.random.default_rng(seed)
    velocity, spin = 1e-7 * random.standard_normal((2, 3)), 1e-6 * random.standard_normal((2, 3))
    return lambda step: rig.speeds(step, STEPS, rig.centre, velocity, spin) < 1e-5


@pytest.mark.parametrize("kind", ["springs", "dashpots"])
def test_bond_limits_are_where_motion_begins_to_grow(kind):
    """Symplectic Euler: 2 / w of the pair's fastest mode; forward Euler: 2 / rate of it.

    The formula for a mesh takes twice the rate of one body against a neighbour that stands still,
    a bound for all neighbours: never longer than the true limit, here shorter by 2 at most.
    For the dashpots the springs are made so soft that they add less than (w dt)^2 / 4 = 1e-6.
    """
    listed, material = [], CONCRETE
    if kind == "dashpots":
        soft = {"normal_stiffness": 450e5, "shear_stiffness": 90e5, "fracture_energy": 1e9}
        material = replace(CONCRETE, **soft)
        listed = [effects.BondDamping()]
    rig = Rig(pair(), filled("bonds", *listed), material=material)
    model = rig.simulation.model
    of, limit = (springs_of, spring_step) if kind == "springs" else (dashpots_of, dashpot_step)
    bonds = LinearBonds(model.mesh, material)
    rate = bonds.largest_rate(bonds.stiffness if kind == "springs" else bonds.damping)
    exact = 2.0 / np.sqrt(rate) if kind == "springs" else 2.0 / rate
    found = bisected(grown(rig, 3), 0.5 * exact, 1.5 * exact)
    # Bisection to 1 / 512 of the bracket, and growth too slow to see within 0.4 % of the limit.
    assert found == pytest.approx(exact, rel=0.007), found / exact
    formula = limit(bond_rates(model.mesh, topology_of(model.mesh), CONCRETE.density, of(material)))
    assert formula.max() <= exact * (1 + 1e-9) < 2.0 * formula.min()


@pytest.mark.parametrize("friction", [False, True])
def test_the_bounds_of_rates_are_the_sums_of_eigenvalues(friction):
    """No eigenvalue is negative: their sum is at least the largest, and at most all six of it.

    A body that meets others in one point without friction has one eigenvalue other than zero.
    """
    mesh = read_mesh(PAPER_BLOCK)
    for of in (springs_of, dashpots_of):
        given = mesh, topology_of(mesh), CONCRETE.density, of(CONCRETE)
        share = bond_bounds(*given) / bond_rates(*given, np.matmul)
        assert 1.0 < share.min() and share.max() < 6.0
    for divisions in (3, 5):
        met = mesh, CONCRETE.density, divisions, friction
        share = contact_bounds(*met) / contact_eigenvalues(*met, np.matmul)
        assert share.min() > 1.0 - 1e-9 and share.max() < 6.0
        assert friction or divisions > 3 or share.max() < 1.0 + 1e-9


def test_rates_of_some_bodies_are_those_of_all():
    """Where bounds leave open whether a step is stable, rates are found for these bodies alone."""
    mesh, some = read_mesh(PAPER_BLOCK), np.array([3, 500, 965])
    given = mesh, topology_of(mesh), CONCRETE.density, springs_of(CONCRETE)
    met = mesh, CONCRETE.density, 3, True
    for rates, of in ((bond_rates, given), (contact_eigenvalues, met)):
        found = rates(*of, bodies=some)
        assert np.array_equal(found[some], rates(*of)[some])
        assert np.count_nonzero(found) == len(some)


#: A method for every way of taking dashpots, and how far above what is told motion surely grows:
#: springs of one body are 1.03 times those of the pair, its dashpots 1.13; limited ones take as
#: much of a step as they may in the worst case alone.
WAYS = {
    "full": (Uniform(1e-9), 1.2),
    "limited": (Uniform(1e-9, dashpot="limited"), 1.4),
    "solved": (ImplicitDashpots(1e-9, refresh=1e-9), 1.1),
}


@pytest.mark.parametrize("way", WAYS)
def test_damped_pair_is_calm_below_what_the_report_tells_and_grows_above(way):
    """Seen at many times: what grew large may come to rest again, far from where it was."""
    method, above = WAYS[way]
    rig = Rig(pair(), filled("bonds", effects.BondDamping()), method)
    told = step_report(rig.simulation.scene).borne(way).min()
    random = np.random.default_rng(3)
    velocity, spin = 1e-7 * random.standard_normal((2, 3)), 1e-6 * random.standard_normal((2, 3))

    def largest(step):
        counts = range(250, STEPS + 1, 250)
        return max(rig.speeds(step, count, rig.centre, velocity, spin) for count in counts)

    assert largest(0.98 * told) < 1e-6
    assert largest(above * told) > 1e-4


def facing(gap):
    """Two equal tetrahedra without a bond, base against base across a gap [m].

    All other faces are in a group hole.
    """
    mesh = single()
    points = mesh.points
    other = points * [-1.0, 1.0, 1.0] + [gap, 0.0, 0.0]
    around = [(0, 1, 2), (0, 2, 3), (0, 3, 1)]
    loaded = [*around, *(tuple(4 + k for k in face) for face in around)]
    bodies = [[0, 1, 2, 3], [4, 6, 5, 7]]
    return checked_mesh(np.vstack([points, other]), bodies, {"hole": loaded})


GAP = 1e-6


def meeting(divisions, material, **gas):
    """Bodies that face each other, with contact and gas alone, by kernels of all effects."""
    contact = effects.SphereContact(divisions, outer_faces=True)
    listed = filled("paper", contact, effects.GasPressure("hole", **gas))
    return Rig(facing(GAP), listed, Uniform(1e-9), material)


def contact_eigenvalue(model, spheres):
    """Largest rate of both bodies by frictionless contacts of unit stiffness, base on base."""
    bodies, block = LinearBonds(model.mesh, CONCRETE), np.zeros((12, 12))
    for first in spheres:
        # In the world both touch the plane between the bases, opposite each other.
        arms = [np.array([-centre[0], *first[1:3]]) for centre in model.centre]
        row = np.hstack([-carried(arms[0])[0], carried(arms[1])[0]])
        block += np.outer(row, row)
    return bodies.largest_rate(block)


@pytest.mark.parametrize("divisions, contacts", [(3, 1), (5, 6)])
def test_sphere_springs_hold_up_to_their_limit(divisions, contacts):
    """Bodies pressed together lie still up to 2 / w of their fastest mode: symplectic Euler.

    Gas on their other faces keeps all contacts closed, so that they are springs both ways. Their
    dashpots are 1e-7 of the material's: w c / 2 k < 1e-5. The formula takes a partner of equal
    rate for all that touch, never longer than the limit, here shorter by 2 at most.
    """
    pressure = 1e6
    gas = {"peak": pressure, "rise": 1e-12, "decay_ratio": 1e12}
    rig = meeting(divisions, replace(CONCRETE, contact_damping=1e-7 * 3.08e6), **gas)
    model = rig.simulation.model
    spheres = model.spheres.centre.reshape(-1, 3)[:contacts]
    rate = CONCRETE.contact_stiffness * contact_eigenvalue(model, spheres)
    exact = 2.0 / np.sqrt(rate)
    push = pressure * 0.05**2 * 3.0**0.5 / 4.0
    overlap = push / (contacts * CONCRETE.contact_stiffness)
    position = rig.centre - np.outer([0.0, 1.0], [GAP + overlap, 0.0, 0.0])
    velocity = 1e-7 * np.random.default_rng(5).standard_normal((2, 3)) * [1.0, 0.0, 0.0]
    together = np.outer([1.0, -1.0], [push / model.body_mass[0], 0.0, 0.0])

    def calm(step):
        # The gas sets in at t = 0: half of its kick is in the first step, the other goes on top.
        start = velocity + 0.5 * step * together
        return rig.speeds(step, STEPS, position, start, np.zeros((2, 3))) < 1e-2

    found = bisected(calm, 0.5 * exact, 1.5 * exact)
    assert found == pytest.approx(exact, rel=0.007), found / exact
    whole = contact_eigenvalues(model.mesh, CONCRETE.density, divisions, False)
    formula = spring_step(CONCRETE.contact_stiffness * whole).min()
    assert exact / 2.0 < formula <= exact * (1 + 1e-6)


@pytest.mark.parametrize("divisions, contacts", [(3, 1), (5, 6)])
def test_sphere_dashpots_kick_back_from_their_limit_on(divisions, contacts):
    """Head on, n contacts change the approach speed by the factor 1 - 2 n c dt / m in a step.

    A pair leaves faster than it came from dt = m / (n c) on. The formula is that for one contact;
    for six it allows for tilting too, and may be shorter, but not by more than 3.
    The overlap is 1e-9 of a radius: springs add 1e-4 of the dashpots at this speed.
    """
    rig = meeting(divisions, CONCRETE, start=1.0)
    model = rig.simulation.model
    position = rig.centre - np.outer([0.0, 1.0], [GAP + 1e-10, 0.0, 0.0])
    velocity = np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]])
    before = np.linalg.norm(velocity)

    def calm(step):
        return rig.speeds(step, 1, position, velocity, np.zeros((2, 3))) <= before

    exact = model.body_mass[0] / (contacts * CONCRETE.contact_damping)
    found = bisected(calm, 0.3 * exact, 1.9 * exact)
    assert found == pytest.approx(exact, rel=0.005)
    whole = contact_eigenvalues(model.mesh, CONCRETE.density, divisions, False)
    formula = dashpot_step(CONCRETE.contact_damping * whole).min()
    if contacts == 1:
        assert formula == pytest.approx(exact, rel=1e-6)
    assert exact / 3.0 < formula <= exact * (1 + 1e-6)


def test_limited_dashpots_of_a_bond_are_stable_at_any_step():
    """A bonded pair at ten times the step that full dashpots bear keeps 1.7 / X of them.

    Growth begins where the pair's rate times the kept share is 2 / dt. X takes twice the rate of
    one body, which is never less than that of the pair: the cap could be 2 at least. Found by
    bisection of a factor on the rates that the limiter knows.
    """
    soft = {"normal_stiffness": 450e5, "shear_stiffness": 90e5, "fracture_energy": 1e9}
    material = replace(CONCRETE, **soft)
    laws = filled("bonds", effects.BondDamping())
    rig = Rig(pair(), laws, Uniform(1e-9, dashpot="limited"), material)
    table = rig.simulation.schedule.limits.dashpot_table
    bonds = LinearBonds(rig.simulation.model.mesh, material)
    known, rate = values(table), bonds.largest_rate(bonds.damping)
    calm = grown(rig, 3)

    def wild(factor):
        assign(table, factor * known)
        return not calm(20.0 / rate)

    exact = 0.5 * LIMITED * rate / (2.0 * known.max())
    assert exact < 0.5 * LIMITED * (1 + 1e-9) < 1.0
    assert bisected(wild, 0.5 * exact, 1.5 * exact) == pytest.approx(exact, rel=0.007)
    assert not wild(1.0)


def test_a_broken_bond_leaves_the_others_what_a_step_bears():
    """Limited dashpots: the rate of each body is that of its bonds which held as the step began."""
    gas = effects.GasPressure("left", peak=2e9, rise=1e-5)
    laws = filled("bonds", effects.BondDamping(), effects.Softening(), gas)
    scene = Scene(bar(0.1, 0.05, (3, 1, 1)), CONCRETE, laws)
    simulation = Simulation(scene, Uniform(1e-7, dashpot="limited"))
    simulation.advance_to(500)
    model, state = simulation.model, simulation.state
    broken = np.append(simulation.values(state.broken_tick), 0)[model.topology.body_bond]
    holds = (broken < 0) | (broken == state.tick[None])
    rates = model.dashpot_rates[np.arange(model.body_count), holds @ [1, 2, 4, 8]]
    assert simulation.report().broken_faces > 0
    assert np.array_equal(simulation.values(simulation.schedule.limits.bond_damping), rates)


@ti.kernel
def shares(limits: ti.template(), step: ti.f64) -> ti.types.vector(2, ti.f64):
    return ti.Vector([limits.bond_share(0, step), limits.contact_share(0, step)])


def test_limited_bonds_leave_contacts_what_they_need():
    """With X = 2 dt rate: contacts take min(X, 0.5) at least, and both together 1.7 at most."""
    listed = [effects.BondDamping(), effects.SphereContact(3, outer_faces=True)]
    scene = Scene(pair(), CONCRETE, listed)
    limits = Simulation(scene, Uniform(1e-9, dashpot="limited")).schedule.limits
    rounding = 4.0 * LIMITED * np.finfo(float).eps
    for x in 10.0 ** np.random.default_rng(1).uniform(-2.0, 2.0, (50, 2)):
        limits.bond_damping[0], limits.contact_damping[0] = 0.5 * x
        taken = shares(limits, 1.0) * x
        assert taken[1] >= min(x[1], FOR_CONTACTS) - rounding
        assert taken.sum() <= LIMITED + rounding


def thrown_together(count=6, aspect=16.0):
    """Slivers, tetrahedra pressed flat, that fly at each other and turn; nothing takes energy."""
    random, body = np.random.default_rng(0), single()
    flat = checked_mesh(body.points / [aspect, 1.0, 1.0], body.tetrahedra, {})
    thin = np.ptp(flat.points[:, 0])
    places = [(1.05 * thin * k, *(5e-3 * random.standard_normal(2))) for k in range(count)]
    parts = {f"sliver_{k}": (flat, place) for k, place in enumerate(places)}
    velocity = 0.2 * random.standard_normal((count, 3))
    velocity[:, 0] += 1.0 - 2.0 * np.arange(count) / count
    spin, elastic = 20.0 * random.standard_normal((count, 3)), replace(CONCRETE, friction=0.0)
    elastic = replace(elastic, normal_damping=0.0, shear_damping=0.0)
    laws = filled("bodies", effects.BodyContact(), group="post_base")
    moves = {"velocity": np.pad(velocity, ((0, 1), (0, 0))), "spin": np.pad(spin, ((0, 1), (0, 0)))}
    return Scene(placed_together(parts | POST), elastic, laws, **moves)


def told_by(scene, method, until, **options):
    """Report of a run, what was said before it, and what of its report names an own limit."""
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        report = simulate(scene, method=method, until=until, progress=None, **options).report
    return report, [str(one.message) for one in heard]


@pytest.mark.parametrize("times", [0.7, 1.4])
def test_a_step_above_the_limit_in_contact_is_told_before_and_after(times):
    """With the limit that ``step_report`` prints; unexplained energy is told from 1 % on."""
    scene = thrown_together()
    limit = step_report(scene).borne("full", "contact").min()
    report, before = told_by(scene, Uniform(times * limit), 4e-3)
    for sentences in (before, report.needs):
        named = [words for words in sentences if f"{limit:.3g} s" in words]
        assert len(named) == (times > 1.0) and all("contact" in words for words in named)
    account = report.energy_balance
    whole = max(report.energy_balance["kinetic"], account["kinetic"] + account["residual"])
    is_open = abs(account["residual"]) >= 0.01 * whole
    assert is_open or times < 1.0
    assert is_open == any(f"{account['residual']:.3g} J" in words for words in report.needs)


#: Ways to step, with that of ``StepReport.borne``; None where no step is above a limit.
STEPPING = {
    "full": (Uniform, "full"),
    "solved": (ImplicitDashpots, "solved"),
    "controlled": (lambda step: Multirate(step, 1e-3, control=StepControl()), None),
}


@pytest.mark.parametrize("name", STEPPING)
def test_a_step_is_warned_of_above_its_own_limit_only(name):
    """Of the bonds of a bar that nothing moves; contact is listed, and nothing touches.

    It is so stiff that explicit steps of both limits, which go with the root, are about as long.
    """
    method, way = STEPPING[name]
    stiff = effects.BodyContact(stiffness=250.0 * CONCRETE.normal_stiffness)
    laws = filled("bodies", effects.Softening(), effects.BondDamping(), stiff)
    scene = Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, laws)
    limits = [step_report(scene).borne(way or "full", link).min() for link in ("bond", "contact")]
    for times in (0.98, 1.1):
        for limit in limits:
            step = times * limit
            report, before = told_by(scene, method(step), 2.0 * step, samples=1)
            above = [one for one in limits if way and step > one]
            assert len(before) == len(above)
            assert all(any(f"{one:.3g} s" in words for words in before) for one in above)
            told = [words for words in report.needs if f"{limits[0]:.3g} s" in words]
            assert len(told) == (limits[0] in above)
