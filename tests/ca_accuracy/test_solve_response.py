"""Questions with a tolerance whose answers are known, and how they cost, repeat and are refused."""

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from ca_damper import (
    Answer,
    Automaton,
    Batch,
    BranchedAnswer,
    Empty,
    Goal,
    InputError,
    Oscillator,
    RigidMass,
    SceneTable,
    SimulationDiverged,
    Spheres,
    goals,
    runtime,
    solve_response,
)
from ca_damper.accuracy import error_reduction, steady_runs
from ca_damper.accuracy.error_reduction import Reduction
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.scene_runs import SceneKey, SceneRuns
from ca_damper.accuracy.steady_runs import BudgetSpent
from ca_damper.progress import BatchProgress, OpenEnded
from taichi_dem.kit.accuracy.answer import ErrorParts
from taichi_dem.kit.accuracy.student import t_quantile
from taichi_dem.kit.progress.progress import Progress
from tests.paper import outside, paper
from tests.processes import users_environment

PAPER = Oscillator()
QUIET = {"progress": None}
#: The function has the name of its module.
MODULE = sys.modules["ca_damper.solve_response"]


def light(damping_ratio):
    """The paper's structure with another damping ratio."""
    return Oscillator(damping=2.0 * damping_ratio * math.sqrt(123.4 * 0.086))


@pytest.mark.parametrize("damping", [0.0006, 0.01228])
def test_an_empty_container_peaks_where_it_must(damping):
    """From rest a damping ratio of 0.0006 takes 265 cycles to come to 63 %."""
    oscillator = light(damping)
    asked = [goals.peak_rms(), goals.peak_ratio()]
    height, ratio = solve_response(
        Empty(), particles=0, goal=asked, oscillator=oscillator, tolerance=0.01, **QUIET
    )
    for answer, wanted in zip((height, ratio), reversed(oscillator.peak())):
        assert isinstance(answer, Answer) and answer.reached and answer.share <= 0.01
        assert abs(answer.value - wanted) <= answer.error
        assert answer.value == pytest.approx(wanted, rel=0.01)
    assert height.result.rms.shape[2] == 1 and height.plan.runs >= 9
    assert height.unit == "m" and ratio.unit == "1"


def test_a_curve_of_a_rigid_mass():
    ratios = (0.9, 0.96, 1.0, 1.05)
    answer = solve_response(
        RigidMass(), particles=30, goal=goals.response_curve(ratios), tolerance=0.003, **QUIET
    )
    wanted = PAPER.rms(np.array(ratios) * PAPER.natural_frequency, 30 * 0.2e-3)
    assert answer.value.shape == answer.error.shape == (4,) and answer.reached
    assert (abs(answer.value - wanted) <= answer.error + 1e-12).all()
    assert answer.error.max() <= 0.003 * answer.value.max()
    assert "4 values" in str(answer)
    mass = solve_response(RigidMass(), particles=30, goal=goals.apparent_mass_at(0.9), **QUIET)
    assert mass.value == pytest.approx(6e-3, rel=1e-3)


def grains(tolerance=0.03, **options):
    """A few grains of the paper's automaton at one frequency."""
    given = {"particles": 20, "goal": goals.rms_at(0.97), **QUIET, **options}
    return solve_response(paper(), tolerance=tolerance, **given)


def test_the_same_question_has_the_same_bits_and_the_same_runs():
    first, second = grains(), grains()
    assert (first.value, first.parts, first.plan.runs) == (
        *(second.value, second.parts),
        second.plan.runs,
    )
    assert np.array_equal(first.result.rms, second.result.rms)
    assert first.plan.method == second.plan.method
    assert (first.plan.pilot_s, first.plan.final_s > 0.0) == (0.0, True)


def test_a_budget_that_is_not_reached_changes_no_bit():
    plain, paid = grains(), grains(budget_s=1e6)
    assert (plain.value, plain.parts, plain.shortfall) == (paid.value, paid.parts, paid.shortfall)
    assert np.array_equal(plain.result.rms, paid.result.rms)
    assert plain.plan.method == paid.plan.method


def test_seeds_that_differ_widen_the_bar_as_student_says(monkeypatch):
    """The bar holds t standard errors of the seeds' mean, whatever their cycles tell."""
    monkeypatch.setattr(MODULE, "SceneRuns", OwnMotions)
    for seeds in (3, 6, 12):
        answer = grains(0.1, seeds=seeds)
        own = answer.result.rms[0, 0]
        half = t_quantile(0.95, seeds - 1) * own.std(ddof=1) / math.sqrt(seeds)
        assert math.hypot(answer.parts.chance, answer.parts.sampling) >= 0.95 * half


def test_one_seed_says_that_the_spread_is_not_in_its_bar():
    alone = grains(0.1, seeds=1)
    assert not alone.reached and "spread from seed to seed was not measured" in alone.shortfall


def test_a_smaller_tolerance_has_a_smaller_bar_and_costs_more_cycles():
    wide, narrow = grains(0.1), grains(0.004)
    assert wide.reached and narrow.reached and narrow.error <= 0.004 * narrow.value
    assert abs(wide.value - narrow.value) <= wide.error + narrow.error
    costs = {round(one.tolerance, 6): one for one in narrow.cost_curve}
    assert costs[0.004].measured and costs[0.004].seconds == pytest.approx(narrow.plan.seconds)
    assert not costs[0.003].measured and costs[0.003].seconds >= costs[0.1].seconds


def test_a_goal_of_one_s_own():
    swing = Goal("largest swing", "m", "extreme", lambda found: found.amplitude[0].max(axis=0))
    answer = solve_response(RigidMass(), particles=10, goal=swing, **QUIET)
    assert answer.goal == "largest swing"
    assert answer.value == pytest.approx(math.sqrt(2.0) * PAPER.peak(2e-3)[1], rel=0.15)


@pytest.mark.parametrize(
    ("span", "side"), [((0.80, 0.9), "above 0.9"), ((1.05, 1.2), "below 1.05")]
)
def test_a_peak_outside_the_ratios_is_said_to_be_outside(span, side):
    with pytest.raises(InputError, match=f"lies outside, {side}"):
        solve_response(Empty(), particles=0, goal=goals.peak_rms(), ratios=span, **QUIET)


def test_a_budget_that_runs_out_gives_the_best_answer_and_says_what_is_missing():
    most = grains(0.0005, budget_s=1.5)
    assert not most.reached and most.error > 0.0005 * most.value
    assert "0.05 % was not reached within budget_s of 1.5 s" in str(most)
    assert most.value == pytest.approx(grains().value, rel=0.05)
    assert most.plan.seconds <= 1.5 * 1.3


def test_a_budget_too_small_for_a_pilot_is_refused():
    with pytest.raises(InputError, match="budget_s must leave time for the pilot"):
        grains(budget_s=1e-6)


def test_given_seeds_are_the_seeds():
    assert grains(0.1, seeds=[7, 9]).result.seeds == (7, 9)
    few = grains(0.0005, seeds=2, budget_s=20.0)
    assert few.result.seeds == (1, 2)


class TwoMotions:
    """Stands for runs of a filling of which every third seed swings by a quarter less."""

    def __init__(self, *given):
        self.runs = SceneRuns(*given)

    def __getattr__(self, name):
        return getattr(self.runs, name)

    def measures(self, key, *rest):
        found = self.runs.measures(key, *rest)
        less = 0.75 if key.seed % 3 == 0 else 1.0
        return {**found, "rms": less * found["rms"]}


class OwnMotions(TwoMotions):
    """Stands for runs of a filling of which each seed swings by a share of its own."""

    def measures(self, key, *rest):
        found = self.runs.measures(key, *rest)
        return {**found, "rms": (1.0 + 0.01 * (7 * key.seed % 13)) * found["rms"]}


def test_several_steady_motions_come_as_branches(monkeypatch):
    """Three seeds differ by more than 1 %: twelve make two clusters of 8 and 4."""
    monkeypatch.setattr(MODULE, "SceneRuns", TwoMotions)
    answer = grains(0.01)
    assert isinstance(answer, BranchedAnswer) and not answer.reached
    assert len(answer.branches) == 2 and answer.branches[1].share < 0.5
    many, few = answer.branches
    assert few.value == pytest.approx(0.75 * many.value, rel=0.02) and answer.value == many.value
    assert {seed % 3 for seed in few.seeds} == {0} and 0 not in {seed % 3 for seed in many.seeds}
    assert "no single number" in str(answer)


def test_a_budget_that_ends_before_further_seeds_gives_the_answer_of_those_before(monkeypatch):
    """Seeds that differ ask for more of them; the second round is not paid any more."""
    rounds, go_steady = [], Reduction._make_steady

    def once(reduction):
        rounds.append(reduction.seeds)
        if len(rounds) > 1:
            raise BudgetSpent(9.0)
        go_steady(reduction)

    monkeypatch.setattr(MODULE, "SceneRuns", OwnMotions)
    monkeypatch.setattr(Reduction, "_make_steady", once)
    answer = grains(0.01, budget_s=5.0)
    assert len(rounds[1]) > len(rounds[0]) and answer.result.seeds == rounds[0]
    assert "within budget_s of 5 s" in answer.shortfall and answer.share > 0.01


def test_a_budget_that_ends_after_a_round_without_a_number_gives_the_round_before(monkeypatch):
    """As where the peak of a further seed lies outside the frequencies there are."""
    rounds, estimates = [], Reduction._estimates

    def lost(reduction):
        rounds.append(reduction.window)
        if len(rounds) == 1:
            return estimates(reduction)
        reduction.runs.cpu_s += 100.0
        found = estimates(reduction)
        return [replace(one, parts=ErrorParts(step=np.full(1, math.nan))) for one in found]

    monkeypatch.setattr(Reduction, "_estimates", lost)
    asked = {"particles": 20, "goal": goals.peak_rms(), "tolerance": 1e-4, **QUIET}
    answer = solve_response(paper(), seeds=3, budget_s=50.0, **asked)
    # The last looks once more at what there is.
    assert len(rounds) == 3 and math.isfinite(answer.error) and answer.error > 0.0
    assert "within budget_s of 50 s" in answer.shortfall


class Shaky:
    """Runs that diverge at steps above a limit [s]."""

    most = 1.2e-4

    def __init__(self, *given):
        self.runs = SceneRuns(*given)

    def __getattr__(self, name):
        return getattr(self.runs, name)

    def go_on(self, cycles):
        if any(key.dt > self.most for key in cycles):
            raise SimulationDiverged(
                "diverged", scene={}, step=1, time_s=0.0, dt=1.0, dt_allowed=0.5
            )
        self.runs.go_on(cycles)


def test_a_step_that_diverges_is_shortened(monkeypatch):
    monkeypatch.setattr(MODULE, "SceneRuns", Shaky)
    assert grains(0.1).result.dt.max() <= 0.5 * Shaky.most
    monkeypatch.setattr(Shaky, "most", 1e-9)
    with pytest.raises(SimulationDiverged):
        grains(0.1)


def test_scenes_go_on_from_where_they_are_each_as_far_as_asked():
    """40 + 30 cycles of one and 70 of the other are the bits of a batch of 70."""
    runs = SceneRuns(Automaton(), 9, PAPER, None)
    keys = [SceneKey(0.95, 3, 2e-4), SceneKey(1.0, 4, 2e-4)]
    runs.go_on({keys[0]: 40, keys[1]: 70})
    runs.go_on({keys[0]: 30, keys[1]: 0})
    frequency = np.array([0.95, 1.0]) * PAPER.natural_frequency
    table = SceneTable(9, [3, 4], 2e-4, frequency, 0.6e-3)
    batch = Batch(Automaton(), table, measured_cycles=70)
    batch.start("rest")
    whole = batch.run(0, 70)
    for s, key in enumerate(keys):
        assert runs.cycles(key) == 70
        assert np.array_equal(runs.series(key)[1][-1:], 0.5 * whole.record[s, -1:, 9:11] @ [1, -1])
        square, mean = (whole.record[s, :, k] / whole.steps[s] for k in (1, 0))
        assert np.array_equal(runs.series(key)[0], np.sqrt(np.maximum(square - mean**2, 0.0)))
    assert runs.steps == int(70 * whole.steps.sum()) and runs.runs == 2


def test_progress_is_told():
    told = []
    grains(0.004, progress=told.append)
    shares = [one.share for one in told if isinstance(one, BatchProgress)]
    assert all(isinstance(one, Progress) for one in told)
    assert shares == sorted(shares) and shares[-1] == 1.0 and shares[0] < 1.0


def test_rounds_come_to_an_end(monkeypatch):
    monkeypatch.setattr(error_reduction, "_MOST_ROUNDS", 1)
    answer = grains(0.0005)
    assert not answer.reached and "after 1 round" in answer.shortfall


def test_a_scene_that_is_never_steady_says_so(monkeypatch):
    """A damping ratio of 1e-6 takes 160,000 cycles; 400 are allowed here."""
    monkeypatch.setattr(steady_runs, "_MOST_CYCLES", 400)
    answer = solve_response(
        Empty(), particles=0, goal=goals.rms_at(1.0), oscillator=light(1e-6), **QUIET
    )
    assert not answer.reached and 0.3 < answer.share <= 1.1
    assert "mean over cycles" in answer.shortfall and "%" in str(answer)


def test_a_base_at_rest_moves_nothing():
    still = Oscillator(base_amplitude=0.0)
    answer = solve_response(Empty(), particles=0, goal=goals.rms_at(1.0), oscillator=still, **QUIET)
    assert (answer.value, answer.error, answer.reached) == (0.0, 0.0, True)
    for goal in (goals.loss_factor_at(1.0), goals.peak_rms()):
        with pytest.raises(InputError, match="must"):
            solve_response(Empty(), particles=0, goal=goal, oscillator=still, **QUIET)


def test_spheres_are_asked_at_their_own_steps():
    """The finer of two steps is 0.7 of the one that resolves a contact in five."""
    answer = solve_response(
        Spheres(), particles=3, goal=goals.rms_at(0.9), tolerance=0.1, seeds=2, **QUIET
    )
    assert answer.reached and 1.3e-5 < answer.result.dt[0] <= 1.5e-5


def test_the_share_of_an_open_end_grows_from_run_to_run():
    told = []
    whole = OpenEnded(told.append)
    whole.pace.seconds = 0.0
    for _ in range(3):
        for share in (0.5, 1.0):
            whole(BatchProgress(share, share, round(100 * share)))
    whole.end()
    shares = [one.share for one in told]
    assert len(shares) == 7 and shares == sorted(set(shares)) and shares[-1] == 1.0
    assert (told[-1].seconds, told[-1].steps) == (3.0, 300)
    OpenEnded(None)(BatchProgress(1.0, 1.0, 1))


_ONE_THREAD = """
from ca_damper import Automaton, goals, runtime, solve_response
runtime.start(threads=1)
asked = [goals.rms_at(0.97), goals.peak_rms()]
for answer in solve_response(Automaton(), particles=9, goal=asked, tolerance=0.1, progress=None):
    print(answer.value.hex(), answer.error.hex(), answer.plan.method)
"""


@pytest.mark.slow
def test_the_number_of_threads_changes_no_bit():
    assert runtime.settings().threads == 2
    asked = [goals.rms_at(0.97), goals.peak_rms()]
    answers = solve_response(Automaton(), particles=9, goal=asked, tolerance=0.1, **QUIET)
    told = subprocess.run(
        [sys.executable, "-c", _ONE_THREAD],
        env=users_environment(),
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    ).stdout
    rows = [(one.value.hex(), one.error.hex(), one.plan.method) for one in answers]
    assert told.splitlines() == [" ".join(row) for row in rows]


def test_an_undamped_container_at_resonance_is_never_steady(monkeypatch):
    """Its RMS grows for ever: the bar says so, and the value is no limit."""
    monkeypatch.setattr(steady_runs, "_MOST_CYCLES", 300)
    flat = Oscillator(damping=0.0)
    answer = solve_response(Empty(), particles=0, goal=goals.rms_at(1.0), oscillator=flat, **QUIET)
    assert not answer.reached and answer.share >= 0.5


def test_ratios_are_where_a_peak_is_looked_for_and_bind_no_frequency_of_a_goal():
    asked = {"particles": 10, "goal": goals.rms_at(1.2), **QUIET}
    free = solve_response(RigidMass(), **asked)
    bound = solve_response(RigidMass(), ratios=(0.9, 1.0), **asked)
    assert bound.value == free.value
    wanted = PAPER.rms(1.2 * PAPER.natural_frequency, 10 * 0.2e-3)
    assert abs(bound.value - wanted) <= bound.error + 1e-9 * wanted
    both = [goals.rms_at(1.2), goals.peak_ratio()]
    far, peak = solve_response(RigidMass(), ratios=(0.9, 1.02), **{**asked, "goal": both})
    assert far.value == pytest.approx(wanted, rel=0.01) and 0.9 < peak.value < 1.02


def test_a_question_may_begin_with_the_plan_of_another():
    """The second begins with the window of the first, and makes fewer rounds; bits are its own."""
    first = grains(0.004)
    begun, again = grains(0.004, plan=first.plan), grains(0.004, plan=first.plan)
    assert begun.reached and (begun.value, begun.parts) == (again.value, again.parts)
    assert begun.plan.window >= first.plan.window and begun.plan.seeds >= first.plan.seeds
    assert abs(begun.value - first.value) <= begun.error + first.error
    assert grains(0.004).value == first.value


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (lambda: "fast", "plan must be that of an answer of solve_response, got 'fast'"),
        (lambda: grains(0.1, particles=15).plan, "plan must be of the same filling and particles"),
    ],
)
def test_plans_of_something_else_are_refused(plan, words):
    with pytest.raises(InputError, match=words):
        grains(plan=plan())


def test_a_method_without_a_limit_says_that_no_step_has_it():
    """Three grains whose pushes alone count change their mass by a third from step to step."""
    with outside():
        answer = solve_response(
            paper(accounting="landing+ejection"),
            particles=3,
            goal=goals.apparent_mass_at(0.983),
            oscillator=Oscillator(base_amplitude=0.3e-3),
            seeds=1,
            **QUIET,
        )
    assert not answer.reached and "changes in no order" in answer.shortfall
    # 8.4e-5 to 12.9e-5 kg at six steps from 4e-4 to 1.25e-5 s.
    for mass in (8.4e-5, 12.9e-5):
        assert abs(answer.value - mass) <= answer.error
    assert answer.share < 1.0


def test_grains_at_rest_lose_nothing_to_rounding():
    """Their loss factor is zero, of which no share can be known: to rounding is good enough."""
    still = Oscillator(base_amplitude=1e-5)
    answer = solve_response(
        Automaton(), particles=5, goal=goals.loss_factor_at(0.8), oscillator=still, **QUIET
    )
    assert answer.reached and abs(answer.value) <= answer.error < 1e-11


def test_spheres_that_start_at_given_places_are_not_drawn():
    """Their seeds would be copies, whose spread of 0 tells nothing."""
    places = [(0.006 + 0.011 * k, 0.02) for k in range(2)]
    for filling, drawn in (
        (Spheres(), True),
        (Spheres(start=places), False),
        (Spheres(start=places, sizes=[(1, 6e-3), (1, 5e-3)]), True),
    ):
        assert Job(filling, 2, Oscillator(), None, None).is_drawn == drawn
