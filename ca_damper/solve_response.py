"""Outputs of the damper to a tolerance, with an error bar."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from ca_damper.accuracy.runs import SceneRuns
from ca_damper.accuracy.sources import MEASURED, filling_source, other_filling
from ca_damper.accuracy.steady_motions import SteadyMotions
from ca_damper.errors import SimulationDiverged
from ca_damper.filling import Filling, check_filling
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.report.progress import OpenEnded
from ca_damper.runs.response import Grid
from taichi_dem.kit.bars.answer import doubted, with_source
from taichi_dem.kit.bars.runs import checked_question
from taichi_dem.kit.bars.search import Search
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress import Listener
from taichi_dem.kit.progress_bar import reporting
from taichi_dem.kit.validation import AUTO, instance, positive, several, shown


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
        Range (lowest, highest) of f/f0 [-] of a peak; None: around the natural frequency.
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
        The question is invalid, the peak is outside ratios, or the budget ends too early.
    SimulationDiverged
        No step that was tried is stable.

    Notes
    -----
    Grains begin at rest, masses that are fixed in their steady state; at half the step a scene goes
    on from where it was. The same question gets the same bits, unless a budget ends it.

    Examples
    --------
    >>> solve_response(Automaton(), particles=30, goal=goals.peak_rms())  # doctest: +SKIP
    """
    check_filling(filling)
    question = checked_question(
        several("goal", goal, lambda name, single: instance(name, single, Goal)),
        MEASURED,
        tolerance=tolerance,
        confidence=confidence,
        budget_s=budget_s,
        sources=sources,
    )
    other = _other(filling, question)
    o = Oscillator() if oscillator is None else instance("oscillator", oscillator, Oscillator)
    single = Grid(filling, particles, 1.0, 1 if seeds is None else seeds, o, None)
    if len(single.particles) != 1:
        raise InputError(f"particles must be one whole number, got {shown(particles)}")
    fixed = None if seeds is None else single.seeds
    solved = partial(_solved, single.particles[0], o, _range(ratios), fixed, progress)
    answers = solved(filling, question)
    others = _others(question, other, answers, solved)
    answers = tuple(_with_filling(*pair, filling) for pair in zip(answers, others))
    return answers if isinstance(goal, (list, tuple)) else answers[0]


def _solved(particles, oscillator, span, fixed, progress, filling, question):
    """Answers to a question about a filling; at shorter steps where runs diverge."""
    # Refuses grains that find no place.
    Grid(filling, particles, 1.0, 1, oscillator, None)
    with reporting(progress, "answer") as listener:
        open_ended = OpenEnded(listener)
        runs = SceneRuns(filling, particles, oscillator, open_ended)
        answers = Search(question, SteadyMotions(question, runs, span, fixed)).answers()
        open_ended.end()
    return answers


def _other(filling, question):
    """Filling that is asked too, None where sources do not name it; InputError where none is."""
    if "filling" not in question.sources:
        return None
    other = other_filling(filling)
    if other is None:
        raise InputError(
            "sources must not have 'filling' unless there are grains of another kind, got "
            f"{shown(filling)}"
        )
    return other


def _others(question, other, answers, solved):
    """Answers of the other filling to the same goals, for each the sentence where it has none."""
    left = question.budget_s - answers[0].plan.seconds
    if other is None:
        return [None] * len(answers)
    if left <= 0.0:
        return ["the budget is spent"] * len(answers)
    try:
        return solved(other, replace(question, budget_s=left))
    except (InputError, SimulationDiverged) as ended:
        return [f"{type(other).__name__}() has no answer: {ended}"] * len(answers)


def _with_filling(answer, other, filling):
    """The answer with its filling as a source of error, where there is another."""
    source = filling_source(answer, filling, other)
    answered = answer if source is None else with_source(answer, source)
    return doubted(answered, other) if isinstance(other, str) else answered


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
