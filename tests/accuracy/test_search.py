"""Which runs a search makes, and what it says, over runs that are made up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import CONCRETE, Scene, goals
from taichi_dem.accuracy import search, sources
from taichi_dem.accuracy.runs import Job
from taichi_dem.effects import BodyContact
from taichi_dem.mesh.shapes import bar
from tests.accuracy.small_bar import UNTIL, struck_bar


class MadeUpRuns:
    """Values by level and twin from a formula, in place of ``taichi_dem.accuracy.runs.Runs``.

    formula(level, twin): a value, None for a run that diverges. moved: way of a usual body between
    two levels. events: whether anything broke. certificate: of each run. residual: energy [J] that
    it leaves unexplained, of 1 J. pairs: evaluations of contacts. A run at level k takes 2^k
    seconds.
    """

    formula, moved, events, certificate, residual, pairs = None, 0.0, False, None, 0.0, 0
    listen = None

    def __init__(self, job, listen):
        self.seconds, self.count, self.failure = 0.0, 0, "it diverged"
        self.results, self.cost, self.known = {}, {}, {}

    def value(self, level, twin=0, tight=False):
        key = level, twin, tight
        if key not in self.known:
            self.count, self.seconds = self.count + 1, self.seconds + 2.0**level
            self.known[key] = type(self).formula(level, twin)
            self.cost[level] = 2.0**level
            report = SimpleNamespace(
                broken_faces=int(self.events),
                pair_evaluations=self.pairs,
                bond_slip=None,
                certificate=self.certificate,
                energy_balance={"kinetic": 1.0, "residual": self.residual},
                round_off_J=0.0,
                needs=(),
            )
            self.results[level] = SimpleNamespace(report=report)
        return self.known[key]

    def release(self):
        """Nothing is held."""

    def change(self, coarse, fine):
        return self.moved

    leap = peak_change = change

    def same_breaks(self, coarse, fine):
        return not self.events

    def parting(self, level):
        return 0.5


@pytest.fixture
def searched(monkeypatch):
    """Answer of a search over made-up runs, by a question and members of ``MadeUpRuns``."""

    def answer(question, formula, budget=math.inf, first=0, **members):
        made = type("Runs", (MadeUpRuns,), {"formula": staticmethod(formula), **members})
        monkeypatch.setattr(search, "Runs", made)
        return search.Search(question, budget, None, first).answer()

    return answer


def scattered(spread, centre=3.0):
    """Formula of values that scatter about a centre, whatever the level."""

    def formula(level, twin):
        return centre + spread * float(np.random.default_rng([level, twin]).standard_normal())

    return formula


def job(tolerance=0.01, goal=None, damping=True):
    """A question whose runs are made up."""
    asked = goals.displacement("right") if goal is None else goal
    return Job(struck_bar(damping), UNTIL, asked, tolerance, 0.95)


def power(order, factor=0.3, limit=3.0):
    """Formula of values of an order, with step 1 at level 0."""
    return lambda level, twin: limit + factor * 2.0 ** (-order * level)


@pytest.mark.parametrize("tolerance", [0.1, 1e-3, 1e-4])
@pytest.mark.parametrize(("order", "events"), [(2.0, False), (1.0, True)])
def test_bars_of_a_power_law_hold_and_are_not_too_wide(searched, tolerance, order, events):
    answer = searched(job(tolerance), power(order), events=events)
    off = abs(answer.value - 3.0)
    if not answer.reached:
        # Seven halvings from the first step are the most.
        assert answer.plan.begin + 1 == 7
    assert off <= answer.error
    seen = answer.error <= 3.1 * off
    assert seen or answer.share <= tolerance, "a wide bar where a narrow one was asked"


def test_a_value_that_agrees_by_chance_has_the_bar_of_what_usual_bodies_do(searched):
    answer = searched(job(0.1), lambda level, twin: 3.0, moved=0.06)
    assert answer.error == pytest.approx(0.5 * 0.06 * 3.0)


def test_twins_that_scatter_get_no_single_number(searched):
    answer = searched(job(0.01), scattered(0.3), events=True, moved=0.1)
    assert not answer.reached and answer.error > 0.01 * answer.value
    assert "goal.mean()" in answer.shortfall
    # Half-width of single runs: about twice the standard deviation, and more for few of them.
    assert 0.3 < answer.parts.chance < 3.0


@pytest.mark.parametrize("failure", ["", "an audit found 1 miss"])
def test_a_certificate_that_does_not_hold_is_never_reached(searched, failure):
    """All levels agree: the bar is zero."""
    certificate = SimpleNamespace(holds=not failure, failure=failure, asleep=0.5)
    answer = searched(job(), lambda level, twin: 3.0, certificate=certificate)
    assert answer.error == 0.0 and answer.reached == (not failure)
    assert failure in answer.shortfall


def test_an_answer_whose_energy_is_lost_is_not_reached(searched):
    """Of the joule that went through the run, less than half is missing, or more."""
    for residual, reached in ((0.4, True), (0.6, False)):
        answer = searched(job(), lambda level, twin: 3.0, residual=residual)
        assert answer.reached == reached
    assert "leaves 0.6 J unexplained" in answer.shortfall


@pytest.mark.parametrize(("off", "reached"), [(0.02, True), (0.3, False)])
def test_what_only_a_source_beside_the_step_breaks_is_refused_in_words(
    searched, monkeypatch, off, reached
):
    """Of second order in 1/parts: bodies with twice the rays differ by 3/4 of the error."""
    formula = staticmethod(lambda level, twin: 3.0 + 0.75 * off)
    monkeypatch.setattr(sources, "Runs", type("Finer", (MadeUpRuns,), {"formula": formula}))
    scene = Scene(bar(0.1, 0.05, (1, 1, 1)), CONCRETE, [BodyContact(3)])
    asked = Job(scene, UNTIL, goals.kinetic_energy(), 0.01, 0.95, ("step", "contact"))
    answer = searched(asked, lambda level, twin: 3.0, pairs=1)
    assert answer.error == answer.parts.contact == pytest.approx(off, rel=1e-9)
    assert answer.reached == reached
    assert ("the contact moves it by 10 %, which no step mends" in answer.shortfall) != reached


def test_the_mean_of_runs_that_scatter_is_found(searched):
    asked = job(0.05, goals.displacement("right").mean())
    answer = searched(asked, scattered(0.1), events=True)
    assert answer.reached and abs(answer.value - 3.0) <= answer.error <= 0.15
    assert 6 <= answer.plan.runs <= 200


def test_runs_that_come_to_two_ends_are_branches(searched):
    ends = {"formula": lambda level, twin: 3.0 if twin % 3 else 4.0, "events": True}
    answer = searched(job(0.01), moved=0.1, **ends)
    assert answer.branches and not answer.reached
    assert [round(one.value, 9) for one in answer.branches] == [3.0, 4.0]
    assert answer.value == 3.0


def test_a_finer_run_that_diverges_leaves_the_best_answer(searched):
    def formula(level, twin):
        return None if level > 1 else power(1.0)(level, twin)

    answer = searched(job(1e-3), formula, events=True)
    assert not answer.reached
    assert answer.value == power(1.0)(1, 0) and answer.error == pytest.approx(0.15)


@pytest.mark.parametrize("budget", [4.0, 30.0])
def test_a_budget_is_kept_and_what_is_missing_is_said(searched, budget):
    answer = searched(job(1e-5), power(1.0), events=True, budget=budget)
    assert answer.plan.seconds <= budget and not answer.reached
    assert "budget" in answer.shortfall and abs(answer.value - 3.0) <= answer.error
