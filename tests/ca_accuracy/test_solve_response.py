"""Questions with a tolerance whose answers are known: bars hold, and what is not known is said."""

import math
import sys

import numpy as np
import pytest

from ca_damper import (
    Automaton,
    Batch,
    Goal,
    Oscillator,
    RigidMass,
    SceneTable,
    goals,
    solve_response,
)
from ca_damper.accuracy.runs import SceneKey, SceneRuns
from ca_damper.report.peak_search import PeakSearch
from tests.damper import paper

PAPER = Oscillator()
QUIET = {"progress": None}
#: The function has the name of its module.
MODULE = sys.modules["ca_damper.solve_response"]


def light(damping_ratio):
    """The paper's structure with another damping ratio."""
    return Oscillator(damping=2.0 * damping_ratio * math.sqrt(123.4 * 0.086))


def test_a_light_container_peaks_where_it_must():
    """From rest a damping ratio of 0.0006 takes 265 cycles to come to 63 %."""
    oscillator = light(0.0006)
    asked = [goals.peak_rms(), goals.peak_ratio()]
    height, ratio = solve_response(
        RigidMass(), particles=0, goal=asked, oscillator=oscillator, tolerance=0.01, **QUIET
    )
    for answer, wanted in zip((height, ratio), reversed(oscillator.peak())):
        assert answer.reached and answer.share <= 0.01
        assert abs(answer.value - wanted) <= answer.error
        assert answer.value == pytest.approx(wanted, rel=0.01)


def test_a_quantity_that_is_zero_has_the_bar_of_its_noise():
    """Of a mass that loses nothing: reached, by less than 1e-12, which rounding is at most."""
    goal = goals.loss_factor_at(1.0)
    answer = solve_response(RigidMass(), particles=30, goal=goal, **QUIET)
    assert answer.reached and abs(answer.value) <= answer.error < 1e-14


@pytest.mark.parametrize(
    ("measure", "peaks"),
    [
        (lambda found: found.amplitude[0], True),
        # What only grows with the frequency, or only falls.
        (lambda found: found.ratios[:, None] ** 2 * np.ones(len(found.seeds)), False),
        (lambda found: -found.ratios[:, None] * np.ones(len(found.seeds)), False),
    ],
)
def test_an_extreme_at_an_end_of_the_frequencies_is_no_answer(measure, peaks):
    """The frequencies are those around the peak of RMS, where another measure may only grow."""
    goal = Goal("largest", "1", lambda found: measure(found).max(axis=0), "extreme")
    answer = solve_response(RigidMass(), particles=30, goal=goal, tolerance=0.05, **QUIET)
    assert answer.reached == peaks == ("frequencies around" not in answer.shortfall)
    assert answer.error <= 0.05 * abs(answer.value)


def test_a_curve_of_a_rigid_mass():
    ratios = (0.9, 0.96, 1.0, 1.05)
    answer = solve_response(
        RigidMass(), particles=30, goal=goals.response_curve(ratios), tolerance=0.003, **QUIET
    )
    wanted = PAPER.rms(np.array(ratios) * PAPER.natural_frequency, 30 * 0.2e-3)
    assert (abs(answer.value - wanted) <= answer.error + 1e-12).all()
    assert answer.reached and answer.error.max() <= 0.003 * answer.value.max()


def grains(tolerance=0.03, **options):
    """A few grains of the paper's automaton at one frequency."""
    given = {"particles": 20, "goal": goals.rms_at(0.97), **QUIET, **options}
    return solve_response(paper(), tolerance=tolerance, **given)


def test_the_same_question_has_the_same_bits_whatever_budget_is_left():
    first, second = grains(), grains(budget_s=1e6)
    assert (first.value, first.parts, first.plan.runs) == (
        *(second.value, second.parts),
        second.plan.runs,
    )
    assert np.array_equal(first.result.rms, second.result.rms)


class Paced(SceneRuns):
    """Runs whose step takes a microsecond on any machine."""

    def _go(self, *given):
        super()._go(*given)
        self.cpu_s, self._pace = 1e-6 * self.steps, 1e-6


def test_a_budget_that_runs_out_gives_the_best_answer_and_says_what_is_missing(monkeypatch):
    monkeypatch.setattr(MODULE, "SceneRuns", Paced)
    most = grains(0.0005, budget_s=0.5, particles=30)
    assert not most.reached and most.error > 0.0005 * most.value
    assert "the budget is spent" in str(most)
    assert most.value == pytest.approx(grains(particles=30).value, rel=0.05)
    assert most.plan.seconds <= 0.5


class TwoMotions(SceneRuns):
    """Runs of a filling of which every third seed swings by a quarter less."""

    def measures(self, key, *rest):
        found = super().measures(key, *rest)
        less = 0.75 if key.seed % 3 == 0 else 1.0
        return {**found, "rms": less * found["rms"]}


def test_several_steady_motions_come_as_branches(monkeypatch):
    """Three seeds differ by more than 1 %: twelve make two clusters of 8 and 4."""
    monkeypatch.setattr(MODULE, "SceneRuns", TwoMotions)
    answer = grains(0.01)
    assert not answer.reached
    assert len(answer.branches) == 2 and answer.branches[1].share < 0.5
    many, few = answer.branches
    assert few.value == pytest.approx(0.75 * many.value, rel=0.02) and answer.value == many.value
    assert {seed % 3 for seed in few.seeds} == {0} and 0 not in {seed % 3 for seed in many.seeds}
    assert "no single number" in str(answer)


def test_scenes_go_on_from_where_they_are_each_as_far_as_asked():
    """40 + 30 cycles of one and 70 of the other are the bits of a batch of 70."""
    frequency = np.array([0.95, 1.0]) * PAPER.natural_frequency
    table = SceneTable(9, [3, 4], 2e-4, frequency, 0.6e-3)
    batch = Batch(Automaton(), table, measured_cycles=70)
    batch.start("rest")
    whole = batch.run(0, 70)
    # Its engine goes on to the next.
    del batch
    runs = SceneRuns(Automaton(), 9, PAPER, None)
    keys = [SceneKey(0.95, 3, 2e-4), SceneKey(1.0, 4, 2e-4)]
    runs.go_on({keys[0]: 40, keys[1]: 70})
    runs.go_on({keys[0]: 30, keys[1]: 0})
    for s, key in enumerate(keys):
        assert runs.cycles(key) == 70
        found = runs.by_cycle(key)
        assert np.array_equal(found["amplitude"][-1:], 0.5 * whole.record[s, -1:, 9:11] @ [1, -1])
        square, mean = (whole.record[s, :, k] / whole.steps[s] for k in (1, 0))
        assert np.array_equal(found["rms"], np.sqrt(np.maximum(square - mean**2, 0.0)))
    assert runs.steps == int(70 * whole.steps.sum()) and runs.runs == 2


def test_a_scene_goes_on_at_half_the_step_from_where_it_is():
    """An empty box swings up: the next cycle is the same but for the samples of one step.

    From rest, or from the other scene's state, it is off by half and more.
    """
    runs = SceneRuns(Automaton(), 0, PAPER, None)
    coarse = [SceneKey(0.8, 1, 4e-4), SceneKey(1.0, 2, 4e-4)]
    runs.go_on(dict.fromkeys(coarse, 10))
    fine = [key._replace(dt=2e-4) for key in reversed(coarse)]
    runs.go_on(dict.fromkeys(fine, 1))
    runs.go_on(dict.fromkeys(coarse, 1))
    for key in fine:
        tenth, wanted = runs.by_cycle(key.coarser)["rms"][-2:]
        (found,) = runs.by_cycle(key)["rms"]
        assert found == pytest.approx(wanted, rel=1.0 / runs.steps_per_cycle(key.ratio, 4e-4))
        assert runs.cycles(key) == 1 and tenth != wanted


def test_a_fixed_mass_begins_in_its_steady_state():
    """Of a damping ratio of 0.0006; 30 grains of 0.2 g. A turn of 1/99 of a cycle a step."""
    oscillator = light(0.0006)
    runs = SceneRuns(RigidMass(), 30, oscillator, None)
    runs.go_on({SceneKey(0.9, 1, 2e-3): 1})
    wanted = oscillator.rms(0.9 * oscillator.natural_frequency, 30 * 0.2e-3)
    assert runs.by_cycle(SceneKey(0.9, 1, 2e-3))["rms"][0] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("damping", [0.0006, 0.0123, 0.05])
@pytest.mark.parametrize("added", [0.0, 0.032])
def test_the_peak_is_found_and_resolved_with_few_frequencies(damping, added):
    own, asked = light(damping), []

    def rms_at(ratios):
        asked.extend(ratios)
        return own.rms(np.array(ratios) * own.natural_frequency, added).tolist()

    ratio, lattice, level = PeakSearch(rms_at, 0.7, 1.04, True).run()
    wanted, height = own.peak(added)
    assert ratio == pytest.approx(wanted, abs=0.3 * damping)
    around = lattice.around(ratio, level)
    rms = own.rms(np.array(around) * own.natural_frequency, added)
    assert 3 <= len(around) <= 4 and around[0] < wanted < around[-1]
    # Neighbours stand on the resonance: half of the peak or more.
    assert rms.min() > 0.5 * height
    assert set(around) <= set(asked) and len(set(asked)) == len(asked) <= 24
