"""Which runs a search makes, and what it says, over runs that are made up."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from taichi_dem import CONCRETE, InputError, Scene, goals
from taichi_dem.accuracy.levels import Levels
from taichi_dem.accuracy.runs import Runs
from taichi_dem.effects import BodyContact
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.bars.runs import Question
from taichi_dem.kit.bars.search import Search
from taichi_dem.mesh.shapes import bar
from taichi_dem.report.energy_balance import TERMS
from tests.scenes import UNTIL, struck_bar

#: An account of which no term is known.
NOTHING = dict.fromkeys(TERMS, 0.0)


class MadeUpRuns(Runs):
    """Values by level and twin from a formula.

    formula(level, twin): a value, None for a run that diverges. moved: way of a usual body between
    two levels. events: whether anything broke. certificate: of each run. residual: energy [J] that
    it leaves unexplained, of 1 J. pairs: evaluations of contacts. A run at level k takes 2^k
    seconds.
    """

    formula, moved, events, certificate, residual, pairs = None, 0.0, False, None, 0.0, 0
    failure = "it diverged"

    def __init__(self, *given):
        super().__init__(*given)
        self.known = {}

    def value(self, level, twin=0, tight=False):
        key = level, twin, tight
        if key not in self.known:
            self.count, self.seconds = self.count + 1, self.seconds + 2.0**level
            self.known[key] = type(self).formula(self.made(level), twin)
            self.cost[level] = 2.0**level
            report = SimpleNamespace(
                broken_faces=int(self.events),
                pair_evaluations=self.pairs,
                bond_slip=None,
                certificate=self.certificate,
                energy_balance={**NOTHING, "kinetic": 1.0, "residual": self.residual},
                round_off_J=0.0,
                needs=(),
            )
            self.results[level] = SimpleNamespace(report=report)
        return self.known[key]

    def made(self, level):
        """The level of the steps that are made, of which there is a whole number."""
        if level == round(level):
            return level
        return math.log2(self.step(0) / self.step(level))

    def eventful(self, level):
        return self.events

    def release(self):
        """Nothing is held."""

    def change(self, coarse, fine):
        return self.moved

    leap = peak_change = change

    def same_breaks(self, coarse, fine):
        return not self.events

    def parting(self, level, tolerance):
        return 0.5


@pytest.fixture
def searched():
    """Answer of a search over made-up runs, by a question, a formula, and members of the runs."""

    def answer(question, formula, budget=math.inf, first=0, until=UNTIL, scene=None, **members):
        made = type("Made", (MadeUpRuns,), {"formula": staticmethod(formula), **members})
        question = replace(question, budget_s=budget)
        runs = made(levels_of(question, until, scene), None, question)
        return Search(question, runs, first).answers()[0]

    return answer


def scattered(spread, centre=3.0):
    """Formula of values that scatter about a centre, whatever the level."""

    def formula(level, twin):
        return centre + spread * float(np.random.default_rng([level, twin]).standard_normal())

    return formula


def asked(tolerance=0.01, goal=None):
    """A question whose runs are made up."""
    return Question((goals.displacement("right") if goal is None else goal,), tolerance)


def levels_of(question, until=UNTIL, scene=None):
    """Steps of the runs that a question is answered by, of the struck bar if no other."""
    return Levels(struck_bar() if scene is None else scene, until, question.goals[0])


def power(order, factor=0.3, limit=3.0):
    """Formula of values of an order, with step 1 at level 0."""
    return lambda level, twin: limit + factor * 2.0 ** (-order * level)


@pytest.mark.parametrize("tolerance", [0.1, 1e-3, 1e-4])
@pytest.mark.parametrize(("order", "events"), [(2.0, False), (1.0, True)])
def test_bars_of_a_power_law_hold_and_are_not_too_wide(searched, tolerance, order, events):
    answer = searched(asked(tolerance), power(order), events=events)
    off = abs(answer.value - 3.0)
    if not answer.reached:
        # Seven halvings from the first step are the most.
        assert answer.plan.begin + 1 == 7
    assert off <= answer.error
    seen = answer.error <= 3.1 * off
    assert seen or answer.share <= tolerance, "a wide bar where a narrow one was asked"


def test_a_value_that_agrees_by_chance_has_the_bar_of_what_usual_bodies_do(searched):
    answer = searched(asked(0.05), lambda level, twin: 3.0, moved=0.06)
    assert answer.error == pytest.approx(1.1 / 3.0 * 0.06 * 3.0)


@pytest.mark.parametrize("tolerance", [0.01, 0.1])
@pytest.mark.parametrize("averaged", [False, True])
def test_two_runs_support_no_bar_below_a_third_of_the_tolerance(searched, tolerance, averaged):
    """Nor do twins that differ by rounding. It costs no run, and what was asked is reached."""
    goal = goals.displacement("right")
    answer = searched(asked(tolerance, goal.mean() if averaged else goal), power(2.0, 1e-6))
    assert answer.reached and answer.error == pytest.approx(tolerance * answer.value / 3.0)
    assert answer.plan.runs == (2 if not averaged else 2 + 5 * 2)
    assert answer.sources[0].error == pytest.approx(answer.error)


@pytest.mark.parametrize(("budget", "runs"), [(math.inf, 3), (3.5, 2)])
def test_the_same_number_twice_is_confirmed_by_a_third_step(searched, budget, runs):
    """Or has the bar of two, where no budget is left for it."""
    answer = searched(asked(0.01), lambda level, twin: 3.0, budget=budget)
    assert answer.plan.runs == runs and answer.reached
    assert answer.error == pytest.approx(0.0 if runs > 2 else 0.01 * 3.0 / 3.0)
    other = searched(asked(0.01), lambda level, twin: 3.0 if level < 1.5 else 2.0)
    assert not other.reached or abs(other.value - 2.0) <= other.error


def test_twins_that_scatter_get_no_single_number(searched):
    answer = searched(asked(0.01), scattered(0.3), events=True, moved=0.1)
    assert not answer.reached and answer.error > 0.01 * answer.value
    assert "goal.mean()" in answer.shortfall
    # Half-width of single runs: about twice the standard deviation, and more for few of them.
    assert 0.3 < answer.parts.chance < 3.0


def test_chance_that_falls_with_the_step_is_followed(searched):
    """Every other twin is off by 0.2 / 4^level of what may be off by 0.15: two levels are enough.

    A single twin tells a half-width of 12.7 times its difference, 0.63; six tell 3.6 times their
    standard deviation, 0.1.
    """
    answer = searched(
        asked(0.05),
        lambda level, twin: 3.0 + 0.2 * 4.0**-level * (twin % 2),
        events=True,
        moved=0.02,
    )
    assert answer.reached and answer.plan.begin == 1
    six = np.array([3.0, 3.05] * 3)
    wide = math.sqrt(2.0) * t_quantile(0.95, 5) * six.std(ddof=1)
    assert answer.parts.chance == pytest.approx(wide)


def test_levels_that_agree_once_twins_have_parted_are_asked_again(searched):
    """From level 2 on bodies move alike; each other twin is off by ten times what is allowed."""
    ways = {"change": lambda self, coarse, fine: 0.1 * (fine < 3)}
    answer = searched(
        asked(0.01),
        lambda level, twin: 3.0 + 0.3 * (twin % 2) * (level < 4),
        **ways,
        same_breaks=lambda self, *levels: True,
        events=True,
    )
    assert len(answer.branches) == 2 and not answer.reached


@pytest.mark.parametrize("value", [52.0, 520.0])
def test_a_count_of_what_breaks_is_known_to_one_at_best(searched, value):
    """To 1 %, which is half of a face, or five; all levels agree."""
    many = asked(0.01, goals.broken_faces())
    answer = searched(many, lambda level, twin: value, events=True, moved=0.0)
    assert answer.error == 1.0 and answer.reached == (value > 100.0)
    assert ("broken faces is known to one" in answer.shortfall) != answer.reached
    none = searched(many, lambda level, twin: 0.0, moved=0.0)
    assert none.error == 0.0 and none.reached


@pytest.mark.parametrize(("events", "long", "again"), [(1, 1, 2.0), (0, 1, 2.0), (0, 20, 1.1)])
def test_runs_are_made_again_with_a_tenth_more_steps_where_nothing_happens(
    searched, events, long, again
):
    """And with 16 more at least, up to twice as many: the short run has 9."""
    given = {"until": long * UNTIL, "events": events, "moved": 0.02}
    answer = searched(asked(0.5), power(1.0), **given)
    steps = answer.plan.seconds - 1.0 - 1.0 * events
    assert steps == pytest.approx(again), "a twin of an eventful run is the third"
    least = 1.0 + again * (1.0 + 1e-9)
    assert searched(asked(0.5), power(1.0), budget=least, **given).plan.runs == 2
    with pytest.raises(InputError, match="budget_s must be at least"):
        searched(asked(0.5), power(1.0), budget=0.99 * least, **given)


def test_a_twin_makes_up_to_30_percent_more_steps():
    levels = levels_of(asked(), 20.0 * UNTIL)
    for level in (0, 1, math.log2(1.1)):
        steps = [round(levels.until / levels.method(level, twin=twin).dt0) for twin in range(6)]
        assert steps[0] == min(steps) and max(steps) <= 1.3 * steps[0] + 0.5
        assert len(set(steps)) == 6


@pytest.mark.parametrize("failure", ["", "an audit found 1 miss"])
def test_a_certificate_that_does_not_hold_is_never_reached(searched, failure):
    """All levels agree: the bar is zero."""
    certificate = SimpleNamespace(holds=not failure, failure=failure, asleep=0.5)
    answer = searched(asked(), lambda level, twin: 3.0, certificate=certificate)
    assert answer.error == 0.0 and answer.reached == (not failure)
    assert failure in answer.shortfall
    left = answer.sources[-1]
    assert left.name == "left out" and left.measured == (not failure)
    # Half of the bodies slept: awake they would take twice the time.
    assert left.seconds == (2.0 * answer.plan.seconds if failure else 0.0)


def test_an_answer_whose_energy_is_lost_is_not_reached(searched):
    """Of the joule that went through the run, less than half is missing, or more."""
    for residual, reached in ((0.4, True), (0.6, False)):
        answer = searched(asked(), lambda level, twin: 3.0, residual=residual)
        assert answer.reached == reached
    assert "leaves 0.6 J unexplained" in answer.shortfall


@pytest.mark.parametrize(("off", "reached"), [(0.02, True), (0.3, False)])
def test_what_only_a_source_beside_the_step_breaks_is_refused_in_words(searched, off, reached):
    """Of second order in 1/parts: bodies with twice the rays differ by 3/4 of the error."""
    formula = staticmethod(lambda level, twin: 3.0 + 0.75 * off)
    finer = type("Finer", (MadeUpRuns,), {"formula": formula})
    scene = Scene(bar(0.1, 0.05, (1, 1, 1)), CONCRETE, [BodyContact(3)])

    def of(self, scene):
        return finer(replace(self.levels, scene=scene))

    measured = Question((goals.kinetic_energy(),), sources=("step", "contact"))
    answer = searched(measured, lambda level, twin: 3.0, scene=scene, pairs=1, of=of)
    assert answer.error == answer.parts.contact == pytest.approx(off, rel=1e-9)
    assert answer.reached == reached
    words = "the contact moves it by 10 %, which no shorter step reduces"
    assert (words in answer.shortfall) != reached


def test_the_mean_of_runs_that_scatter_is_found(searched):
    mean = asked(0.05, goals.displacement("right").mean())
    answer = searched(mean, scattered(0.1), events=True)
    assert answer.reached and abs(answer.value - 3.0) <= answer.error <= 0.15
    assert 6 <= answer.plan.runs <= 200


def test_runs_that_come_to_two_ends_are_branches(searched):
    ends = {"formula": lambda level, twin: 3.0 if twin % 3 else 4.0, "events": True}
    answer = searched(asked(0.01), moved=0.1, **ends)
    assert answer.branches and not answer.reached
    assert [round(one.value, 9) for one in answer.branches] == [3.0, 4.0]
    assert answer.value == 3.0


def test_a_finer_run_that_diverges_leaves_the_best_answer(searched):
    def formula(level, twin):
        return None if level > 1 else power(1.0)(level, twin)

    answer = searched(asked(1e-3), formula, events=True)
    assert not answer.reached
    assert answer.value == power(1.0)(1, 0) and answer.error == pytest.approx(0.15)


@pytest.mark.parametrize("budget", [4.0, 30.0])
def test_a_budget_is_kept_and_what_is_missing_is_said(searched, budget):
    answer = searched(asked(1e-5), power(1.0), events=True, budget=budget)
    assert answer.plan.seconds <= budget and not answer.reached
    assert "budget" in answer.shortfall and abs(answer.value - 3.0) <= answer.error
