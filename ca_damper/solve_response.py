"""Ask for an output of the damper with a tolerance, get it with an error bar.

A pilot at a coarse step finds the frequencies that the goal needs; scenes at two steps and of a few
seeds then go on, each until its transient has ended and the mean over its cycles, the seeds and
the step leave a bar that is narrow enough. Nothing begins again that can go on.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.accuracy.error_reduction import STEP_ORDER, Reduction
from ca_damper.accuracy.error_sources import ONE_SEED, shortfall
from ca_damper.accuracy.goal_estimate import Estimate, response_of
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.plan import DamperPlan, checked_plan
from ca_damper.accuracy.scene_runs import SceneRuns
from ca_damper.accuracy.step_part import step_part
from ca_damper.errors import SimulationDiverged
from ca_damper.filling import Filling, check_filling
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.report.progress import OpenEnded
from ca_damper.runs.response import Grid
from taichi_dem.kit.bars.answer import (
    Answer,
    ErrorParts,
    Plan,
    branched,
    branches_of,
    cost_curve,
    doubted,
)
from taichi_dem.kit.bars.chance import clusters_of, t_quantile
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener
from taichi_dem.kit.progress.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, between, finite, instance, positive, shown

# A run that diverges is repeated at a shorter step so often.
_MOST_SHORTENED = 6
_SHORTER = 1.5


def solve_response(
    filling: Filling,
    *,
    particles: int,
    goal: Goal | Sequence[Goal],
    tolerance: float = 0.01,
    confidence: float = 0.95,
    budget_s: float | None = None,
    oscillator: Oscillator | None = None,
    ratios: tuple[float, float] | None = None,
    seeds: int | Sequence[int] | None = None,
    plan: Plan | None = None,
    progress: Listener | str | None = AUTO,
) -> Any:
    """Value of one or several goals, with an error bar.

    Parameters
    ----------
    filling : Filling
        Filling of the container.
    particles : int
        Number of particles.
    goal : Goal or sequence of Goal
        One of ``goals``, or several, which share their runs.
    tolerance : float, default 0.01
        Half-width of the bar as a share of the value, or of a curve's largest.
    confidence : float, default 0.95
        Probability [-] with which the bar holds the value of endless runs at a vanishing step.
    budget_s : float, optional
        CPU time after which the best answer is returned and says what is missing [s]; None for no
        limit.
    oscillator : Oscillator, optional
        Primary structure; that of the paper if None.
    ratios : tuple of (float, float), optional
        Range (lowest, highest) of f/f0 [-] in which to look for a peak. None: one around the
        natural frequency, which is left where the peak is outside.
    seeds : int or sequence of int, optional
        Number of seeds or the seeds themselves; as many as it takes if None.
    plan : Plan, optional
        Plan of an earlier answer for this filling and as many particles: begin at its step, seeds
        and cycles.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.

    Returns
    -------
    Answer or tuple of Answer
        The tuple for several goals. It has branches where seeds come to several steady motions.

    Raises
    ------
    InputError
        The question cannot be asked, the peak is outside ratios, or the budget ends before there is
        anything to tell.
    SimulationDiverged
        No step that was tried is stable.

    Notes
    -----
    Runs begin at rest. The same question gets the same bits, unless a budget ends it.

    Examples
    --------
    >>> solve_response(Automaton(), particles=30, goal=goals.peak_rms())  # doctest: +SKIP
    """
    goals = _goals_of(goal)
    question = _question(filling, particles, oscillator, ratios, seeds)
    question.goals, question.budget_s = goals, _budget(budget_s)
    question.tolerance = _share("tolerance", tolerance)
    question.plan = checked_plan(plan, filling, question.particles)
    question.confidence = between("confidence", confidence, 0.5, 0.9999)
    with reporting(progress, "answer") as listener:
        question.listener = OpenEnded(listener)
        reduction, estimates = _answered(question)
        question.listener.end()
    failures = reduction.runs.failures
    made = (_answer(question, reduction, found) for found in estimates)
    answers = tuple(doubted(answer, *failures) for answer in made)
    return answers if isinstance(goal, (list, tuple)) else answers[0]


def _question(filling, particles, oscillator, ratios, seeds):
    """Job of the checked arguments."""
    check_filling(filling)
    oscillator = Oscillator() if oscillator is None else oscillator
    instance("oscillator", oscillator, Oscillator)
    one = Grid(filling, particles, 1.0, 1 if seeds is None else seeds, oscillator, None)
    if len(one.particles) != 1:
        raise InputError(f"particles must be one whole number, got {shown(particles)}")
    fixed = None if seeds is None else one.seeds
    return Job(filling, one.particles[0], oscillator, _range(ratios), fixed)


def _goals_of(goal):
    goals = tuple(goal) if isinstance(goal, (list, tuple)) else (goal,)
    for one in goals:
        if not isinstance(one, Goal):
            raise InputError(
                f"goal must be a Goal such as goals.peak_rms(), or a list of them, got {shown(one)}"
            )
    if not goals:
        raise InputError("goal must be a Goal or a list of at least one, got none")
    return goals


def _share(name, value):
    if not finite(value) or not 0.0 < value <= 1.0:
        raise InputError(
            f"{name} must be a share in (0, 1], such as 0.01 for 1 %, got {shown(value)}"
        )
    return float(value)


def _budget(budget_s):
    return math.inf if budget_s is None else positive("budget_s", budget_s)


def _range(ratios):
    """(lowest, highest) of a range, or None."""
    if ratios is None:
        return None
    listed = isinstance(ratios, (list, tuple, np.ndarray)) and getattr(ratios, "ndim", 1) == 1
    two = listed and len(ratios) == 2
    if not two or not all(map(finite, ratios)) or not 0.0 < ratios[0] < ratios[1]:
        raise InputError(
            "ratios must be None or two numbers (lowest, highest) with 0 < lowest < highest, "
            f"got {shown(ratios)}"
        )
    return float(ratios[0]), float(ratios[1])


def _answered(job: Job) -> tuple[Reduction, list[Estimate]]:
    """Estimates that are good enough, or the best ones; shorter steps where runs diverge."""
    runs = SceneRuns(job.filling, job.particles, job.oscillator, job.listener)
    dt = job.first_step()
    for attempt in range(_MOST_SHORTENED + 1):
        reduction = Reduction(job, runs, dt)
        try:
            return reduction, reduction.run()
        except SimulationDiverged:
            if attempt == _MOST_SHORTENED:
                raise
            dt /= _SHORTER
    raise AssertionError("unreachable")


def _answer(job: Job, done: Reduction, found: Estimate) -> Answer:
    """Answer of an estimate, with branches where its seeds fall into clusters."""
    goal, ratios = found.goal, done.ratios_of(found.goal)
    response = response_of(done.runs, ratios, done.seeds, done.dt, done.steady.begins())
    value, parts = _told(goal, found.value, found.parts)
    base: dict[str, Any] = {"goal": goal.name, "unit": goal.unit, "plan": _plan(job, done)}
    base.update(result=response, tolerance=job.tolerance, confidence=job.confidence)
    branches = _branches(job, done, found)
    if branches:
        step = _step_of(branches, done.steps, found, job.confidence)
        made = Answer(**base, value=value, parts=parts)
        return branched(made, branches, step, "seed", "took {} steady motions")
    words = shortfall(found, job.tolerance, done.ended)
    if job.is_drawn and len(done.seeds) == 1:
        words = "; ".join(filter(None, (words, ONE_SEED)))
    made = Answer(**base, value=value, parts=parts, shortfall=words)
    return replace(made, cost_curve=_cost_curve(job, done, made))


def _told(goal, value, parts):
    """Value and parts as a user gets them: arrays for a curve, else numbers where there is one."""
    if goal.kind == "curve" or len(value) > 1:
        return value, parts
    names = ("step", "chance", "sampling")
    return float(value[0]), ErrorParts(**{name: float(getattr(parts, name)[0]) for name in names})


def _branches(job, done, found):
    """Branches of the seeds, of goals with one value."""
    if found.value.size != 1:
        return ()
    values, error = found.fine.values[:, 0], math.sqrt(float(found.fine.variance[0]))
    clusters = clusters_of(values, error, 0.5 * found.allowed(job.tolerance))
    if len(clusters) < 2:
        return ()
    t = t_quantile(job.confidence, found.fine.freedom)
    return branches_of(values, clusters, done.seeds, error, t)


def _step_of(branches, steps, found, confidence):
    """Error by the step of the first branch, from its seeds at each step."""
    rows = []
    for step, level in zip(steps, found.levels):
        values = level.values[:, 0]
        distance = np.abs(values[:, None] - [branch.value for branch in branches])
        own = values[distance.argmin(axis=1) == 0]
        if len(own):
            error = np.sqrt(level.variance / len(own)).item()
            rows.append((step, own.mean(), error))
    some = np.array(rows)
    if len(some) < 2 or 2.0 not in some[:, 0]:
        return 0.0
    values = some[:, 1:2], some[:, 2:3]
    return float(step_part(some[:, 0].tolist(), *values, STEP_ORDER, confidence).error[0])


def _plan(job, done):
    """Plan in words."""
    label, seeds = job.filling.label, counted(len(done.seeds), "seed")
    frequencies = done.frequencies()
    several = "1 frequency" if len(frequencies) == 1 else f"{len(frequencies)} frequencies"
    method = f"{label}, {done.dt:.3g} s, {several}, {seeds}, up to {done.longest()} cycles"
    return DamperPlan(
        method,
        runs=done.runs.runs,
        pilot_s=done.pilot_s,
        final_s=done.runs.cpu_s - done.pilot_s,
        filling=job.filling,
        particles=job.particles,
        dt=done.dt,
        seeds=len(done.seeds),
        window=done.window,
        has_between=done.has_between,
        margin=done.margin,
    )


def _cost_curve(job, done, made):
    """Costs of usual tolerances: that of the cycles and seeds beyond the transients grows as 1/x^2.

    One that has been reached costs what was paid at most.
    """
    if not math.isfinite(made.share) or made.share <= 0.0:
        return ()
    paid = done.runs.cpu_s
    fixed = done.pilot_s + done.transient_share() * (paid - done.pilot_s)

    def cost(tolerance):
        if tolerance == job.tolerance and made.reached:
            return paid, True
        wider = made.share / tolerance
        return fixed + (paid - fixed) * max(1.0, wider * wider), False

    return tuple(cost_curve(job.tolerance, cost))
