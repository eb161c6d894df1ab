"""Order of the step, and one answer: one step for all, neighbours held or drifted, or solved."""

import itertools

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Simulation, Uniform, effects
from taichi_dem.kit.allocation import assign, values
from taichi_dem.mesh.shapes import bar
from taichi_dem.methods import Method
from taichi_dem.stability.step_report import bond_steps
from taichi_dem.state.timeline import MAX_LEVEL
from tests.scenes import brisk_scene

UNTIL = 1e-5
#: Macro steps in a run; the step halves from one to the next.
STEPS = (100, 200, 400, 800)


@ti.data_oriented
class Unchanged:
    """Every body keeps the level it started with."""

    @ti.func
    def wanted(self, level, speed2, low):
        """The present level."""
        return level


class FixedLevels(Method):
    """Multirate without a rule: the order of a scheme shows where its steps do not jump."""

    name, uniform = "fixed_levels", False

    def __init__(self, neighbour):
        self.neighbour, self.dt0 = neighbour, UNTIL / STEPS[0]

    def criterion(self):
        """Step rule for the schedule."""
        return Unchanged()


class MovingBar:
    """18 bodies, unstrained, with random velocities and spins; runs again at any step.

    The kernels are compiled once: steps and dashpots are numbers in fields.
    """

    def __init__(self, neighbour):
        scene = Scene(bar(0.3, 0.1, (3, 1, 1)), CONCRETE, [effects.BondDamping()])
        self.simulation = Simulation(scene, FixedLevels(neighbour))
        model, state = self.simulation.model, self.simulation.state
        random = np.random.default_rng(3)
        turn = np.tile([1.0, 0.0, 0.0, 0.0], (model.body_count, 1))
        velocity, spin = random.standard_normal((2, model.body_count, 3))
        state.set_motion(model.centre, turn, velocity, 10.0 * spin)
        self.mixed = random.integers(0, 4, model.body_count).astype(np.int32)
        self.fields = state.fields()
        self.first = {name: values(field) for name, field in self.fields.items()}
        self.simulation.start()

    def position_after(self, steps, levels, damped):
        """Positions at UNTIL [m]."""
        simulation, state = self.simulation, self.simulation.state
        for name, field in self.fields.items():
            assign(field, self.first[name])
        assign(state.level, levels)
        damping = np.array([CONCRETE.normal_damping, CONCRETE.shear_damping])
        bonds = simulation.model.bond_count
        assign(simulation.tables.dashpot.coefficient, np.tile(damping * damped, (bonds, 1)))
        dt0 = UNTIL / steps
        for k in range(MAX_LEVEL + 1):
            simulation.schedule.step_seconds[k] = dt0 / 2.0**k
        simulation.driver.begin()
        simulation.advance_to(steps)
        assert np.array_equal(simulation.values(state.level), levels)
        return state.motion()["position"]


@pytest.fixture(scope="module")
def bars():
    """A bar for each treatment of the neighbours."""
    return {neighbour: MovingBar(neighbour) for neighbour in ("held", "drifted")}


def orders(moving, levels, damped):
    """Observed orders: with x = x0 + C dt^p, differences of successive runs fall 2^p-fold."""
    runs = [moving.position_after(steps, levels, damped) for steps in STEPS]
    gaps = [np.linalg.norm(a - b) for a, b in itertools.pairwise(runs)]
    return np.log2(np.array(gaps[:-1]) / gaps[1:])


def slack(moving, damped):
    """How far an order may be off: the next term of the error, in the finest step compared.

    It is smaller than the first by a step times the fastest rate, of a spring or a dashpot, both
    from the stability limit 2 / rate.
    """
    limits = bond_steps(moving.simulation.model.mesh, CONCRETE)
    limit = limits["bond_dashpot" if damped else "bond_stiffness"].min()
    return np.log2(1.0 + 2.0 / limit * UNTIL / STEPS[-2])


def check_order(moving, levels, damped, order):
    """The order at the finest steps, within its slack."""
    error = slack(moving, damped)
    assert error < 0.5
    assert orders(moving, levels, damped)[-1] == pytest.approx(order, abs=error)


def test_one_step_for_all_is_leapfrog(bars):
    """v += dt F(x) / m, then x += dt v: positions of second order.

    These are the positions of the leapfrog whose velocities live half a step earlier. The one at
    the start is off by dt F / 2 m, which is nothing for an unstrained bar.
    """
    still = np.zeros_like(bars["held"].mixed)
    check_order(bars["held"], still, False, 2.0)


def test_held_neighbours_cost_the_second_order(bars):
    """A bond sees the coarse body where it was up to a step ago: an opening wrong by v dt."""
    moving = bars["held"]
    assert len(np.unique(moving.mixed)) == 4
    check_order(moving, moving.mixed, False, 1.0)


def test_drifted_neighbours_keep_the_second_order(bars):
    """Each bond kicks both bodies at its own times: an asynchronous variational integrator."""
    moving = bars["drifted"]
    check_order(moving, moving.mixed, False, 2.0)


@pytest.mark.parametrize("neighbour", ["held", "drifted"])
def test_explicit_dashpots_are_of_first_order(bars, neighbour):
    """A dashpot takes the velocity before the kick, half a step old, in every scheme."""
    moving = bars[neighbour]
    check_order(moving, moving.mixed, True, 1.0)


def blown(method, until):
    """The brisk block at a time [s]."""
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(round(until / method.dt0))
    return simulation


def test_solved_dashpots_are_of_second_order_before_anything_breaks():
    """Half the step, a quarter of the difference of two runs: springs, dashpots, gas and slip.

    The next terms are of fourth order as the scheme is symmetric in time: (dt / rise)^2 = 4e-4
    of them at the pulse's rise of 4e-5 s.
    """
    places = []
    for step in (8e-7, 4e-7, 2e-7):
        simulation = blown(ImplicitDashpots(step, sweeps=(2, 100), tolerance=1e-5), 8e-6)
        assert simulation.report().broken_faces == 0
        places.append(simulation.motion()["position"])
        simulation.close()
    coarse, fine = (np.linalg.norm(a - b) for a, b in itertools.pairwise(places))
    moved = np.linalg.norm(places[-1] - simulation.model.centre)
    assert fine > 1e-5 * moved
    assert coarse / fine == pytest.approx(4.0, rel=0.002)


def test_multirate_stays_within_the_error_of_its_steps():
    """A body's step is at most 2^levels that of the uniform run, its error in proportion.

    Both runs obey the same rule, |v| dt <= l; where the steps of the uniform run are s times
    shorter its error is s times smaller. The bound takes the mean ratio of the steps, which is
    the gain in body updates, plus one for the uniform run's own error. What is left of that is
    the velocity that dashpots take, half a step old. Between steps of different length it is a
    whole one, of a partner's last time. The uniform run is of first order: its error at l is
    twice the difference to l / 2.
    """
    until = 2.5e-5
    simulation = blown(Uniform(1e-8, 2e-7), until)
    coarse, evaluated = simulation.motion()["position"], simulation.report().contact_evaluations
    simulation.close()
    fine = blown(Uniform(5e-9, 1e-7), until).motion()["position"]
    error = 2.0 * np.linalg.norm(coarse - fine)
    several = blown(Multirate(1e-8, 2e-7), until)
    report = several.report()
    assert len(np.unique(several.values(several.state.level))) >= 3
    assert report.ideal_gain > 1.5
    assert error < 0.01 * np.linalg.norm(coarse - simulation.model.centre)
    away = np.linalg.norm(several.motion()["position"] - coarse)
    assert away < (1.0 + 2.0 * report.ideal_gain) * error
    assert report.contact_evaluations < evaluated
