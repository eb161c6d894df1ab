"""Answers of real scenes: bars beside far finer runs, edges, chaos, the same bits."""

import math
import subprocess
import sys
import weakref
from dataclasses import replace

import numpy as np
import pytest

from taichi_dem import (
    CONCRETE,
    Checkpoint,
    ImplicitDashpots,
    Scene,
    Simulation,
    effects,
    goals,
    simulate,
    solve,
)
from taichi_dem.accuracy.job import Job
from taichi_dem.accuracy.runs import Runs
from taichi_dem.mesh.shapes import bar, placed_together, single
from tests.accuracy.drawn import blast_question, dropped_question
from tests.accuracy.small_bar import UNTIL, struck_bar
from tests.equivalence.test_bits import ENVIRONMENT
from tests.scenes import ROOT, apart
from tests.slow import slow_but

GOALS = (
    goals.broken_faces(),
    goals.displacement("left"),
    goals.kinetic_energy(),
    goals.largest_fragment(),
)


def broken_bar(peak):
    """Bar of twelve bodies under a blow that comes back as tension, and may break it."""
    blow = effects.GasPressure("left", peak=peak, rise=1e-5, decay_ratio=1.5)
    breaks = [effects.Softening(), effects.ShearSlip(), effects.SphereContact(), effects.Friction()]
    held = [effects.BondDamping(), *breaks, effects.Fixed("right")]
    return Scene(bar(0.1, 0.05, (2, 1, 1)), CONCRETE, [blow, *held])


def finer(scene, until, goal, answer, levels=4):
    """Value of a goal with the step of an answer over 2^levels."""
    job = Job(scene, until, goal, answer.tolerance, answer.confidence)
    return Runs(job, job.methods(), None).value(answer.plan.begin + 1 + levels)


def edge_of_breaking(level, until=3e-4):
    """Two peaks of the pressure next to each other: with the upper one something breaks.

    level: of the step at which it does.
    """
    held, breaks = 1e6, 1e9
    while True:
        middle = 0.5 * (held + breaks)
        if middle in (held, breaks):
            return held, breaks
        job = Job(broken_bar(middle), until, goals.broken_faces(), 0.01, 0.95)
        if Runs(job, job.methods(), None).value(level):
            breaks = middle
        else:
            held = middle


@pytest.mark.slow
@pytest.mark.parametrize("level", [0, 1])
def test_no_number_is_bare_where_a_bond_is_on_its_edge(level):
    """One rounding decides at a step; the bar holds what finer steps decide, or is too wide."""
    until = 3e-4
    for peak in edge_of_breaking(level, until):
        for goal in GOALS:
            answer = solve(broken_bar(peak), until=until, goal=goal, progress=None)
            true = finer(broken_bar(peak), until, goal, answer)
            assert abs(answer.value - true) <= answer.error, (goal.name, str(answer), true)
            assert answer.reached == (answer.share <= 0.01 or answer.error == 0.0)


@pytest.mark.slow
def test_bodies_that_bounce_have_no_single_number():
    asked = dropped_question()
    answer = solve(asked.scene, until=asked.until, goal=asked.goal, progress=None)
    assert not answer.reached and answer.share > 0.1
    assert "goal.mean()" in answer.shortfall and "rounding" in answer.shortfall
    assert 0.0 < answer.plan.parting_s < asked.until
    # Before twins part, a single run tells.
    early = solve(
        asked.scene,
        until=0.5 * answer.plan.parting_s,
        goal=asked.goal,
        tolerance=0.05,
        progress=None,
    )
    assert early.reached and math.isinf(early.plan.parting_s)
    # What is known of such scenes is told by later runs of the kind.
    said = simulate(asked.scene, method=answer.result.method, until=1e-4, samples=1, progress=None)
    assert "part from" in said.report.known_error


@pytest.mark.parametrize("seed", slow_but(range(4), 3))
def test_bars_of_drawn_questions_hold(seed):
    """Four of those of experiments/accuracy_on_request.py, where about 95 of 100 hold."""
    asked = blast_question(500 + seed)
    given = {"until": asked.until, "goal": asked.goal, "tolerance": asked.tolerance}
    answer = solve(asked.scene, **given, progress=None)
    true = finer(asked.scene, asked.until, asked.goal, answer, 3)
    assert abs(answer.value - true) <= answer.error, str(answer)


def test_the_same_question_has_the_same_bits_also_after_another():
    def bits():
        answer = solve(broken_bar(9e8), until=3e-4, goal=GOALS[2], progress=None)
        return answer.value, answer.error, answer.plan.runs

    first = bits()
    solve(struck_bar(), until=UNTIL, goal=goals.displacement("right"), progress=None)
    assert bits() == first


SCRIPT = """
import sys
from taichi_dem import goals, runtime, solve
from tests.accuracy.test_answers import broken_bar

runtime.start(threads=int(sys.argv[1]))
answer = solve(broken_bar(9e8), until=3e-4, goal=goals.kinetic_energy(), progress=None)
print(answer.value.hex(), answer.error.hex(), answer.plan.runs)
"""


@pytest.mark.slow
def test_threads_change_no_bit():
    said = [
        subprocess.run(
            [sys.executable, "-c", SCRIPT, threads],
            capture_output=True,
            text=True,
            cwd=ROOT,
            env=ENVIRONMENT,
            check=True,
        ).stdout
        for threads in ("1", "2")
    ]
    assert said[0] == said[1] and said[0].count("0x") == 2


def test_a_run_that_goes_on_from_a_checkpoint_gives_the_answer(tmp_path):
    """The run that an answer rests on, stopped in the middle and gone on with: the same bits."""
    scene, until, goal = broken_bar(9e8), 3e-4, GOALS[2]
    answer = solve(scene, until=until, goal=goal, progress=None)
    kept = Checkpoint(tmp_path / "half.npz")
    looks = {"samples": 1, "frames": 1, "progress": None, "method": answer.result.method}
    simulate(scene, until=0.5 * until, checkpoint=kept, **looks)
    result = simulate(scene, until=until, resume=kept.path, **looks)
    assert goal.value(result) == answer.value


def test_a_plan_spares_runs_and_keeps_the_value():
    scene, question = struck_bar(), {"until": UNTIL, "goal": goals.kinetic_energy()}
    first = solve(scene, tolerance=1e-4, progress=None, **question)
    again = solve(scene, tolerance=1e-4, progress=None, plan=first.plan, **question)
    assert again.plan.runs < first.plan.runs and again.value == first.value
    assert again.plan.begin == first.plan.begin


def test_a_finished_run_leaves_nothing_on_the_engine():
    """A simulation that lived on would have its data put aside by the next one."""
    simulation = Simulation(struck_bar(), ImplicitDashpots(1e-6))
    gone = weakref.ref(simulation.loan)
    del simulation
    assert gone() is None
    simulate(struck_bar(), method=ImplicitDashpots(1e-6), until=UNTIL, frames=2, progress=None)
    simulation = Simulation(struck_bar(), ImplicitDashpots(1e-6))
    assert [*simulation.loan.engine.loans] == [simulation.loan]


@pytest.mark.slow
def test_the_mean_of_bodies_that_bounce_is_found():
    asked = dropped_question()
    looks = {"until": 0.005, "tolerance": 0.5, "progress": None}
    answer = solve(asked.scene, goal=asked.goal.mean(), **looks)
    assert answer.reached and answer.parts.chance > 0.0 and answer.plan.runs > 6
    assert np.isfinite(answer.value) and answer.goal.startswith("mean ")


def test_bodies_that_fall_freely_have_an_answer_to_rounding():
    """No spring limits the step; half of g t^2 is exact at any."""
    scene = Scene(apart(3), CONCRETE, [effects.Gravity((0.0, 0.0, -9.81))])
    answer = solve(scene, until=0.2, goal=goals.body_displacement(1), progress=None)
    assert answer.reached and answer.value == pytest.approx(1e3 * 0.5 * 9.81 * 0.2**2, rel=1e-9)


def test_bodies_without_bonds_take_the_step_of_their_contacts():
    """A body that falls on a held one and comes back: the same energy as before."""
    parts = {"held": (single(0.05), (0.0, 0.0, 0.0)), "falling": (single(0.05), (0.06, 0.0, 0.0))}
    mesh = placed_together(parts)
    chosen = [effects.Gravity((-2e4, 0.0, 0.0)), effects.FaceContact(), effects.Fixed("held_base")]
    scene = Scene(mesh, replace(CONCRETE, contact_damping=0.0), chosen)
    answer = solve(scene, until=2e-3, goal=goals.kinetic_energy(), tolerance=0.1, progress=None)
    assert answer.result.report.pair_evaluations > 0
    true = finer(scene, 2e-3, goals.kinetic_energy(), answer, 3)
    assert abs(answer.value - true) <= answer.error
