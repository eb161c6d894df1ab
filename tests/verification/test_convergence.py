"""Order of the step, and one answer: one step for all, neighbours held or drifted, or solved."""

import itertools
from functools import cache

import numpy as np
import pytest
import taichi as ti

from taichi_dem import CONCRETE, ImplicitDashpots, Multirate, Scene, Simulation, Uniform, effects
from taichi_dem.kit.allocation import assign
from taichi_dem.mesh.shapes import bar
from taichi_dem.methods import Method
from taichi_dem.stability.step_report import bond_steps
from tests.scenes import brisk_scene
from tests.structures import filled

UNTIL = 1e-5
#: Macro steps in a run; the step halves from one to the next.
STEPS = (200, 400, 800)


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

    def __init__(self, neighbour, dt0):
        self.neighbour, self.dt0 = neighbour, dt0
        self.structure = neighbour

    def criterion(self):
        """Step rule for the schedule."""
        return Unchanged()


#: 18 bodies, unstrained, with random velocities and spins, and levels.
BAR = bar(0.3, 0.1, (3, 1, 1))
RANDOM = np.random.default_rng(3)
VELOCITY, SPIN = RANDOM.standard_normal((2, BAR.body_count, 3))
MIXED = RANDOM.integers(0, 4, BAR.body_count).astype(np.int32)


def position_after(steps, neighbour, levels, damped):
    """Positions of the bar at UNTIL [m]."""
    laws = filled("bonds", *([effects.BondDamping()] * damped))
    scene = Scene(BAR, CONCRETE, laws, velocity=VELOCITY, spin=10.0 * SPIN)
    simulation = Simulation(scene, FixedLevels(neighbour, UNTIL / steps))
    assign(simulation.state.level, levels)
    simulation.advance_to(steps)
    assert np.array_equal(simulation.values(simulation.state.level), levels)
    return simulation.motion()["position"]


def check_order(neighbour, levels, damped, order):
    """Observed order: with x = x0 + C dt^p, differences of successive runs fall 2^p-fold.

    It may be off by the next term of the error, in the finest step compared, which is smaller than
    the first by a step times the fastest rate, of a spring or a dashpot, both from the stability
    limit 2 / rate.
    """
    limit = bond_steps(BAR, CONCRETE)["bond_dashpot" if damped else "bond_stiffness"].min()
    error = np.log2(1.0 + 2.0 / limit * UNTIL / STEPS[-2])
    assert error < 0.5
    runs = [position_after(steps, neighbour, levels, damped) for steps in STEPS]
    coarse, fine = (np.linalg.norm(a - b) for a, b in itertools.pairwise(runs))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=error)


def test_one_step_for_all_is_leapfrog():
    """v += dt F(x) / m, then x += dt v: positions of second order.

    These are the positions of the leapfrog whose velocities live half a step earlier. The one at
    the start is off by dt F / 2 m, which is nothing for an unstrained bar.
    """
    check_order("held", np.zeros_like(MIXED), False, 2.0)


@pytest.mark.parametrize(
    ("neighbour", "damped", "order"),
    [
        # A bond sees the coarse body where it was up to a step ago: an opening wrong by v dt.
        ("held", False, 1.0),
        # Each bond kicks both bodies at its own times: an asynchronous variational integrator.
        ("drifted", False, 2.0),
        # A dashpot takes the velocity before the kick, half a step old, in every scheme.
        ("held", True, 1.0),
        ("drifted", True, 1.0),
    ],
)
def test_neighbours_of_other_steps_have_the_order_of_their_treatment(neighbour, damped, order):
    assert len(np.unique(MIXED)) == 4
    check_order(neighbour, MIXED, damped, order)


def blown(method, until):
    """The brisk block at a time [s]."""
    simulation = Simulation(brisk_scene(), method)
    simulation.advance_to(round(until / method.dt0))
    return simulation


#: Time [s] until which some bonds have broken, and sweeps until what is left of them is small.
BROKEN, SWEPT = 2.5e-5, {"sweeps": (2, 100), "tolerance": 1e-5}


@cache
def places_at(part):
    """Positions [m] at BROKEN by one step for all, and contacts evaluated; part: of step and l."""
    simulation = blown(Uniform(1e-8 * part, 2e-7 * part), BROKEN)
    places, evaluated = simulation.motion()["position"], simulation.report().contact_evaluations
    simulation.close()
    return places, evaluated


def explicit_error():
    """Of first order: twice the difference to half the step and half of l [m]."""
    return 2.0 * np.linalg.norm(places_at(1.0)[0] - places_at(0.5)[0])


def test_solved_dashpots_come_to_the_motion_of_explicit_ones():
    """Through breaks and contacts, which both meet up to a step late: an error of first order."""
    places = []
    for step in (5e-7, 2.5e-7):
        simulation = blown(ImplicitDashpots(step, **SWEPT), BROKEN)
        assert simulation.report().broken_faces > 0
        places.append(simulation.motion()["position"])
        simulation.close()
    error = 2.0 * np.linalg.norm(places[0] - places[1]) + explicit_error()
    assert np.linalg.norm(places[0] - places_at(1.0)[0]) < error
    assert error < 0.01 * np.linalg.norm(places[0] - simulation.model.centre)


def test_solved_dashpots_are_of_second_order_before_anything_breaks():
    """Half the step, a quarter of the difference of two runs: springs, dashpots, gas and slip.

    The next terms are of fourth order as the scheme is symmetric in time: (dt / rise)^2 = 4e-4
    of them at the pulse's rise of 4e-5 s.
    """
    places = []
    for step in (8e-7, 4e-7, 2e-7):
        simulation = blown(ImplicitDashpots(step, **SWEPT), 8e-6)
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
    coarse, evaluated = places_at(1.0)
    error = explicit_error()
    several = blown(Multirate(1e-8, 2e-7), BROKEN)
    report = several.report()
    assert len(np.unique(several.values(several.state.level))) >= 3
    assert report.ideal_gain > 1.5
    assert error < 0.01 * np.linalg.norm(coarse - several.model.centre)
    away = np.linalg.norm(several.motion()["position"] - coarse)
    assert away < (1.0 + 2.0 * report.ideal_gain) * error
    assert report.contact_evaluations < evaluated
