"""Outputs of the damper to a tolerance, with an error bar."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.accuracy.estimate import STEP_ORDER, Estimate
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.runs import SceneRuns
from ca_damper.accuracy.search import Search
from ca_damper.accuracy.sources import MEASURED, filling_source, other_filling
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
    with_source,
)
from taichi_dem.kit.bars.budget import Source, named_sources
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.bars.step import step_part
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, SMALLEST, between, instance, positive, several, shown

# A run that diverges is repeated at a shorter step so often.
_MOST_SHORTENED = 6
_SHORTER = 1.5
#: Why one seed of a filling that draws is no answer.
_ONE_SEED = (
    "the spread from seed to seed was not measured and is not in the bar: two seeds or more show it"
)


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
    sources: Iterable[str] = ("step",),
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
        Probability [-] with which the bar holds the value of infinite runs at a vanishing step.
    budget_s : float, optional
        CPU time after which the best answer is returned, with what it lacks [s]; None for no limit.
    oscillator : Oscillator, optional
        Primary structure; that of the paper if None.
    ratios : tuple of (float, float), optional
        Range (lowest, highest) of f/f0 [-] in which to look for a peak. None: one around the
        natural frequency, which grows if the peak is outside.
    seeds : int or sequence of int, optional
        Number of seeds or the seeds themselves; as many as it takes if None.
    sources : iterable of str, default ("step",)
        Sources of error to measure and include in the bar: ``"step"``, always; ``"filling"``, by
        the same question to the other model of the grains, ``Spheres`` or ``Automaton``.
    progress : callable or str or None, default "auto"
        As in ``frequency_response``.

    Returns
    -------
    Answer or tuple of Answer
        A tuple for several goals. It has branches if seeds reach several steady motions.

    Raises
    ------
    InputError
        The question is invalid, the peak is outside ratios, or the budget ends before there is an
        answer.
    SimulationDiverged
        No step that was tried is stable.

    Notes
    -----
    Runs begin at rest. The same question gets the same bits, unless a budget ends it.

    Examples
    --------
    >>> solve_response(Automaton(), particles=30, goal=goals.peak_rms())  # doctest: +SKIP
    """
    check_filling(filling)
    other = _other(filling, sources)
    oscillator = Oscillator() if oscillator is None else oscillator
    instance("oscillator", oscillator, Oscillator)
    one = Grid(filling, particles, 1.0, 1 if seeds is None else seeds, oscillator, None)
    if len(one.particles) != 1:
        raise InputError(f"particles must be one whole number, got {shown(particles)}")
    question = Job(
        filling,
        one.particles[0],
        oscillator,
        goals=several("goal", goal, lambda name, one: instance(name, one, Goal)),
        tolerance=between("tolerance", tolerance, SMALLEST, 1.0),
        confidence=between("confidence", confidence, 0.5, 0.9999),
        budget_s=math.inf if budget_s is None else positive("budget_s", budget_s),
        span=_range(ratios),
        fixed=None if seeds is None else one.seeds,
    )
    answers = _solved(question, progress)
    others = _others(question, other, answers, progress)
    answers = tuple(_with_filling(*pair, filling) for pair in zip(answers, others))
    return answers if isinstance(goal, (list, tuple)) else answers[0]


def _solved(question, progress):
    """Answers of a question to all of its goals."""
    with reporting(progress, "answer") as listener:
        open_ended = OpenEnded(listener)
        search, estimates = _answered(replace(question, listener=open_ended))
        open_ended.end()
    return tuple(doubted(_answer(search, found), *search.doubts(found.goal)) for found in estimates)


def _other(filling, sources):
    """Filling that is asked too, None where sources do not name it; InputError where none is."""
    if "filling" not in named_sources(sources, MEASURED):
        return None
    other = other_filling(filling)
    if other is None:
        raise InputError(
            "sources must not have 'filling' unless there are grains of another kind, got "
            f"{shown(filling)}"
        )
    return other


def _others(question, other, answers, progress):
    """Answers of the other filling to the same goals, for each the sentence where it has none."""
    left = question.budget_s - answers[0].plan.seconds
    if other is None:
        return [None] * len(answers)
    if left <= 0.0:
        return ["the budget is spent"] * len(answers)
    try:
        # Refuses grains that find no place.
        Grid(other, question.particles, 1.0, 1, question.oscillator, None)
        asked = replace(question, filling=other, budget_s=left)
        return _solved(asked, progress)
    except (InputError, SimulationDiverged) as ended:
        return [f"{type(other).__name__}() has no answer: {ended}"] * len(answers)


def _with_filling(answer, other, filling):
    """The answer with its filling as a source of error, where there is another."""
    source = filling_source(answer, filling, other)
    made = answer if source is None else with_source(answer, source)
    return doubted(made, other) if isinstance(other, str) else made


def _range(ratios):
    if ratios is None:
        return None
    ends = several("ratios", ratios, positive)
    if len(ends) != 2 or ends[0] >= ends[1]:
        raise InputError(
            "ratios must be None or two numbers (lowest, highest) with 0 < lowest < highest, "
            f"got {shown(ratios)}"
        )
    return ends


def _answered(job: Job) -> tuple[Search, list[Estimate]]:
    """Estimates that are good enough, or the best ones; shorter steps where runs diverge."""
    runs = SceneRuns(job.filling, job.particles, job.oscillator, job.listener)
    dt = job.first_step()
    for _ in range(_MOST_SHORTENED):
        search = Search(job, runs, dt)
        try:
            return search, search.run()
        except SimulationDiverged:
            dt /= _SHORTER
    search = Search(job, runs, dt)
    return search, search.run()


def _answer(done: Search, found: Estimate) -> Answer:
    """Answer of an estimate, with branches where its seeds fall into clusters."""
    job, goal, seeds = done.job, found.goal, done.at.seeds
    value, parts = _told(goal, found.value, found.parts)
    made = Answer(
        goal=goal.name,
        unit=goal.unit,
        value=value,
        parts=parts,
        tolerance=job.tolerance,
        confidence=job.confidence,
        plan=_plan(done),
        result=done.readings.response(done.ratios_of(goal), seeds, done.at.dt),
        shortfall=found.shortfall(job.tolerance, done.ended),
        sources=_sources(done, parts),
    )
    clusters = found.clusters(job.tolerance)
    if len(clusters) > 1:
        t = t_quantile(job.confidence, found.fine.freedom)
        error = math.sqrt(float(found.fine.variance[0]))
        branches = branches_of(found.fine.values[:, 0], clusters, seeds, error, t)
        step = _step_of(branches, done.steps, found, job.confidence)
        return branched(made, branches, step, "seed", "reached {} steady motions")
    if job.is_drawn and len(seeds) == 1:
        made = doubted(made, _ONE_SEED)
    return replace(made, cost_curve=_cost_curve(done, made))


def _sources(done, parts):
    """Sources of error that runs of the question show."""
    seeds, cycles = counted(len(done.at.seeds), "seed"), counted(done.longest(), "cycle")
    return (
        Source("step", parts.step, f"{done.at.dt:.3g} s and longer ones", done.runs.cpu_s),
        Source("chance", parts.chance, seeds, 0.0),
        Source("sampling", parts.sampling, f"up to {cycles}, and what is left of the start", 0.0),
    )


def _told(goal, value, parts):
    if goal.kind == "curve" or len(value) > 1:
        return value, parts
    names = ("step", "chance", "sampling")
    return float(value[0]), ErrorParts(**{name: float(getattr(parts, name)[0]) for name in names})


def _step_of(branches, steps, found, confidence):
    """Error by the step of the first branch, from its seeds at each step."""
    rows = []
    for step, level in zip(steps, found.levels):
        values = level.values[:, 0]
        distance = np.abs(values[:, None] - [branch.value for branch in branches])
        own = values[distance.argmin(axis=1) == 0]
        if len(own):
            rows.append((step, own.mean(), np.sqrt(level.variance / len(own)).item()))
    some = np.array(rows)
    if len(some) < 2 or 2.0 not in some[:, 0]:
        return 0.0
    values = some[:, 1:2], some[:, 2:3]
    return float(step_part(some[:, 0].tolist(), *values, STEP_ORDER, confidence).error[0])


def _plan(done):
    label, seeds = done.job.filling.label, counted(len(done.at.seeds), "seed")
    count = len(done.frequencies())
    several = "1 frequency" if count == 1 else f"{count} frequencies"
    method = f"{label}, {done.at.dt:.3g} s, {several}, {seeds}, up to {done.longest()} cycles"
    final_s = done.runs.cpu_s - done.pilot_s
    return Plan(method, done.runs.runs, done.pilot_s, final_s)


def _cost_curve(done, made):
    """Costs of usual tolerances: that of cycles and seeds beyond the transients grows as 1/x^2."""
    if not math.isfinite(made.share) or made.share <= 0.0:
        return ()
    paid = done.runs.cpu_s
    fixed = done.pilot_s + done.transient_share() * (paid - done.pilot_s)

    def cost(tolerance):
        if tolerance == made.tolerance and made.reached:
            return paid, True
        wider = made.share / tolerance
        return fixed + (paid - fixed) * max(1.0, wider * wider), False

    return tuple(cost_curve(made.tolerance, cost))
