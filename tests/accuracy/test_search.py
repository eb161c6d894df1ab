"""Which runs a search makes, and what it says, over runs that are made up."""

import math

import pytest

from taichi_dem import BranchedAnswer, InputError, SimulationDiverged, goals
from taichi_dem.accuracy.job import Job
from taichi_dem.diagnostics.certificate import Certificate
from taichi_dem.kit.audit import Audit
from tests.accuracy.made_up_runs import scattered, searched
from tests.accuracy.small_bar import UNTIL, struck_bar


def job(tolerance=0.01, goal=None, **changed):
    """A question whose runs are made up."""
    asked = goals.displacement("right") if goal is None else goal
    return Job(struck_bar(**changed), UNTIL, asked, tolerance, 0.95)


def power(order, factor=0.3, limit=3.0):
    """Formula of values of an order, with step 1 at level 0."""
    return lambda level, twin: limit + factor * 2.0 ** (-order * level)


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 1e-3, 1e-4])
@pytest.mark.parametrize(("order", "events"), [(2.0, False), (1.0, True), (2.0, True)])
def test_bars_of_a_power_law_hold_and_are_not_too_wide(monkeypatch, tolerance, order, events):
    answer = searched(monkeypatch, job(tolerance), power(order), events=events)
    off = abs(answer.value - 3.0)
    if not answer.reached:
        # Seven halvings from the first step are the most.
        assert answer.plan.begin + 1 == 7 and "changes as much" in answer.shortfall
    assert off <= answer.error
    seen = answer.error <= 3.1 * off
    assert seen or answer.share <= tolerance, "a wide bar where a narrow one was asked"


def test_no_more_is_run_than_the_order_asks_for(monkeypatch):
    """0.3 / 4 at level 1 is a bar of 0.1125 of 3.075: 3.7 %; at level 2 1.25 x 0.019, 0.8 %."""
    assert searched(monkeypatch, job(0.04), power(2.0)).plan.runs == 2
    two = searched(monkeypatch, job(0.01, damping=False), power(2.0))
    assert two.plan.runs == 3 and two.plan.begin == 1


def test_a_value_that_agrees_by_chance_has_the_bar_of_what_usual_bodies_do(monkeypatch):
    answer = searched(
        monkeypatch, job(0.1), lambda level, twin: 3.0, change_between=lambda a, b: 0.06
    )
    assert answer.error == pytest.approx(0.5 * 0.06 * 3.0)


def test_twins_that_scatter_get_no_single_number(monkeypatch):
    answer = searched(
        monkeypatch, job(0.01), scattered(0.3), events=True, change_between=lambda a, b: 0.1
    )
    assert not answer.reached and answer.error > 0.01 * answer.value
    assert "goal.mean()" in answer.shortfall and answer.plan.parting_s == 0.5
    # Half-width of single runs: about twice the standard deviation, and more for few of them.
    assert 0.3 < answer.parts.chance < 3.0


def certified(impulse=0.0, misses=0):
    """Certificate of a run of which half of all bodies slept."""
    audit = Audit(1000, 10, misses, "bonds asleep")
    return Certificate((), 1, 1, 1e-6, 0.5, impulse, 0.0, (audit,), ())


@pytest.mark.parametrize("value", [0.0, 3.0])
@pytest.mark.parametrize(
    ("certificate", "why"),
    [
        (certified(), ""),
        (certified(impulse=2e-6), "sleep left out 2e-06 of a part's impulse, 1e-06 asked"),
        (certified(misses=1), "an audit of 10 skipped bonds asleep found 1 miss"),
    ],
)
def test_a_certificate_that_does_not_hold_is_never_reached(monkeypatch, value, certificate, why):
    """All levels agree: the bar is zero. Half of the bodies slept: all of them take twice as long.

    The two runs take 1 and 2 s.
    """
    answer = searched(monkeypatch, job(), lambda level, twin: value, certificate=certificate)
    assert answer.error == 0.0 and answer.reached == certificate.holds == (not why)
    advice = "run the scene with effects='all', about 6 s"
    words = f"the certificate of its run does not hold, as {why}: {advice}"
    assert answer.shortfall == (words if why else "")


def test_branches_of_runs_in_doubt_tell_both(monkeypatch):
    more = {"events": True, "change_between": lambda a, b: 0.1, "certificate": certified(1.0)}
    formula = lambda level, twin: 3.0 if twin % 3 else 4.0  # noqa: E731
    answer = searched(monkeypatch, job(0.01), formula, **more)
    assert "came to 2 ends" in answer.shortfall and "does not hold" in answer.shortfall


def test_an_answer_whose_energy_is_lost_is_not_reached(monkeypatch):
    """Of the joule that went through the run, less than half is missing, or more."""
    for residual, reached in ((0.4, True), (0.6, False)):
        answer = searched(monkeypatch, job(), lambda level, twin: 3.0, residual=residual)
        assert answer.reached == reached
    assert "leaves 0.6 J unexplained" in answer.shortfall


def test_twins_of_which_some_diverge_have_no_spread(monkeypatch):
    """Two of five are lost; those that are left are within a tenth of what is allowed."""
    answer = searched(
        monkeypatch,
        job(0.01),
        lambda level, twin: None if twin > 3 else 3.0 + 0.003 * (twin > 0),
        events=True,
    )
    assert not answer.reached and "diverged: it diverged" in answer.shortfall


def test_the_mean_of_runs_that_scatter_is_found(monkeypatch):
    asked = job(0.05, goals.displacement("right").mean())
    answer = searched(monkeypatch, asked, scattered(0.1), events=True)
    assert answer.reached and abs(answer.value - 3.0) <= answer.error <= 0.15
    assert 6 <= answer.plan.runs <= 200


def test_a_mean_that_takes_too_many_runs_says_what_it_has(monkeypatch):
    asked = job(1e-4, goals.displacement("right").mean())
    answer = searched(monkeypatch, asked, scattered(1.0), events=True)
    assert not answer.reached and "the mean of 96 runs has" in answer.shortfall


def test_runs_that_come_to_two_ends_are_branches(monkeypatch):
    answer = searched(
        monkeypatch,
        job(0.01),
        lambda level, twin: 3.0 if twin % 3 else 4.0,
        events=True,
        change_between=lambda a, b: 0.1,
    )
    assert isinstance(answer, BranchedAnswer) and not answer.reached
    assert [round(one.value, 9) for one in answer.branches] == [3.0, 4.0]
    assert answer.value == 3.0 and "no single number" in answer.shortfall
    assert "came to 2 ends" in answer.shortfall


def test_twins_that_part_at_the_first_step_alone_do_not_end_the_search(monkeypatch):
    def formula(level, twin):
        return power(2.0)(level, 0) + (0.5 * twin if level == 0 else 0.0)

    answer = searched(
        monkeypatch, job(0.01), formula, events=True, change_between=lambda a, b: 0.01
    )
    assert answer.reached and abs(answer.value - 3.0) <= answer.error


def test_the_first_steps_may_diverge(monkeypatch):
    def formula(level, twin):
        return None if level < 2 else power(2.0)(level, twin)

    answer = searched(monkeypatch, job(0.05), formula)
    assert answer.reached and answer.plan.begin == 2


def test_no_stable_step_is_said(monkeypatch):
    with pytest.raises(SimulationDiverged, match="it diverged"):
        searched(monkeypatch, job(), lambda level, twin: None)


def test_a_finer_run_that_diverges_leaves_the_best_answer(monkeypatch):
    def formula(level, twin):
        return None if level > 1 else power(1.0)(level, twin)

    answer = searched(monkeypatch, job(1e-3), formula, events=True)
    assert not answer.reached and "a smaller step diverged" in answer.shortfall
    assert answer.value == power(1.0)(1, 0) and answer.error == pytest.approx(0.15)


@pytest.mark.parametrize("budget", [4.0, 10.0, 30.0, 100.0])
def test_a_budget_is_kept_and_what_is_missing_is_said(monkeypatch, budget):
    answer = searched(monkeypatch, job(1e-5), power(1.0), events=True, budget=budget)
    assert answer.plan.seconds <= budget and not answer.reached
    assert "budget" in answer.shortfall and abs(answer.value - 3.0) <= answer.error


def test_a_budget_below_two_runs_is_refused(monkeypatch):
    with pytest.raises(InputError, match="budget_s must leave time for two runs, 3 s here, got 2"):
        searched(monkeypatch, job(), power(2.0), budget=2.0)


def test_a_plan_begins_where_the_last_question_ended(monkeypatch):
    first = searched(monkeypatch, job(0.001), power(2.0))
    again = searched(monkeypatch, job(0.01), power(2.0), first=first.plan.begin)
    assert again.plan.begin == first.plan.begin and again.plan.runs == 2 < first.plan.runs


@pytest.mark.parametrize("tolerance", [0.3, 0.03, 0.003])
def test_costs_of_other_tolerances_rise_and_those_that_were_reached_are_measured(
    monkeypatch, tolerance
):
    curve = searched(monkeypatch, job(tolerance), power(2.0)).cost_curve
    assert [one.tolerance for one in curve] == sorted(
        (one.tolerance for one in curve), reverse=True
    )
    assert [one.seconds for one in curve] == sorted(one.seconds for one in curve)
    asked = next(one for one in curve if one.tolerance == tolerance)
    assert asked.measured and all(one.measured for one in curve if one.tolerance > tolerance)
    # What is predicted is what it takes, to a factor of two.
    least = searched(monkeypatch, job(0.003), power(2.0))
    assert 0.4 < curve[-1].seconds / least.plan.seconds < 2.5 or curve[-1].tolerance > 0.003


def test_a_value_of_zero_is_no_division(monkeypatch):
    answer = searched(
        monkeypatch,
        job(),
        lambda level, twin: 0.1 * twin,
        events=True,
        change_between=lambda a, b: 0.1,
    )
    assert answer.value == 0.0 and not answer.reached and "about zero" in answer.shortfall
    assert math.isfinite(answer.error)
