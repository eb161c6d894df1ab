"""An answer made of what is known at the end of a search."""

import math
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from taichi_dem.kit.bars.answer import (
    Answer,
    ErrorParts,
    Expense,
    Plan,
    branched,
    branches_of,
    doubted,
    largest,
    with_source,
)
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.evidence import Evidence, GoalEstimate
from taichi_dem.kit.display import counted

#: Tolerances of which an answer tells the cost.
_TOLERANCES = (0.1, 0.03, 0.01, 0.003)


@dataclass(frozen=True)
class Assembly:
    """Answers of a search. rounds: CPU time after each [s], and what was known then."""

    known: Evidence
    rounds: list[tuple[float, list[GoalEstimate]]]
    pilot_s: float
    hopeless: bool

    def answers(self) -> tuple[Answer, ...]:
        """An answer to each goal."""
        estimates = self.rounds[-1][1]
        return tuple(map(self._answer, range(len(estimates)), estimates))

    def _answer(self, k, estimate):
        known, asked, runs, goal = self.known, self.known.question, self.known.runs, estimate.goal
        last, total = known.levels[-1], largest(estimate.parts.total)
        sources = self._sources(estimate.parts)
        beside = tuple(runs.beside(known.levels[0], last, known.affords))
        several = largest(estimate.parts.chance) > estimate.allowed
        parting = runs.parting(known.twin_level, asked.tolerance) if several else math.inf
        doubts = tuple(runs.doubts(goal, known.levels, total, known.affords))
        spent, begin = (self.pilot_s, runs.seconds - self.pilot_s), math.ceil(last) - 1
        short = f"{100.0 * asked.tolerance:g} % was not reached: {known.why}" if known.why else ""
        answer = Answer(
            goal=goal.name,
            unit=goal.unit,
            value=estimate.value,
            parts=estimate.parts,
            tolerance=asked.tolerance,
            confidence=asked.confidence,
            plan=Plan(runs.in_words(last, known.seeds), runs.count, *spent, begin, parting),
            result=runs.result(goal, last, known.seeds),
            cost_curve=self._costs(k),
            shortfall=short if not runs.averaged or estimate.excess > 1.0 else "",
            sources=sources,
        )
        answer = _told(self._divided(answer, estimate), goal)
        return doubted(reduce(with_source, beside, answer), *doubts)

    def _sources(self, parts):
        """Sources of error that runs of this question show, with the CPU time of all of them."""
        known, runs = self.known, self.known.runs
        falling = f"{counted(runs.count, 'run')} at falling steps"
        if known.is_pair:
            falling = "2 runs at falling steps, a third of the tolerance at least"
        twins = counted(known.seeds - 1, "twin") if known.seeds > 1 else "nothing can split twins"
        step = Source("step", np.hypot(parts.step, parts.solver), falling, runs.seconds)
        sources = step, Source("chance", parts.chance, twins, 0.0)
        if not np.ndim(parts.sampling):
            return sources
        words = "what is left of the start, and frequencies around a peak"
        return *sources, Source("sampling", parts.sampling, words, 0.0)

    def _divided(self, answer, estimate):
        """The answer with its branches, where runs have a few outcomes."""
        ends = self.known.clusters(estimate)
        if not ends:
            return answer
        values, clusters = ends
        step = self.known.errors(estimate.goal)[0].error
        branches = branches_of(values, clusters, self.known.runs.names(len(values)), step)
        return branched(
            answer, branches, estimate.parts.step, self.known.runs.run, self.known.runs.ends
        )

    def _costs(self, k):
        """Costs of usual tolerances: of the round that had each, or as a power of it."""
        seconds, last = self.rounds[-1][0], self.rounds[-1][1][k]
        share = largest(last.parts.total) / largest(last.value) if largest(last.value) else 0.0
        if not math.isfinite(share):
            return ()

        def cost(tolerance):
            for spent, estimates in self.rounds:
                if largest(estimates[k].parts.total) <= tolerance * largest(estimates[k].value):
                    return Expense(tolerance, spent, True)
            more = (share / tolerance) ** last.power
            return Expense(tolerance, self.pilot_s + (seconds - self.pilot_s) * more, False)

        floor = largest(last.parts.chance) / largest(last.value) if self.hopeless else 0.0
        some = sorted({*_TOLERANCES, self.known.question.tolerance}, reverse=True)
        return tuple(cost(level) for level in some if level >= floor)


def _told(answer, goal):
    """The answer with numbers in place of arrays, of a goal with one value."""
    if np.size(answer.value) > 1 or goal.kind == "curve":
        return answer
    parts = {name: float(np.sum(value)) for name, value in vars(answer.parts).items()}
    sources = tuple(replace(source, error=float(np.sum(source.error))) for source in answer.sources)
    value = float(np.sum(answer.value))
    return replace(answer, value=value, parts=ErrorParts(**parts), sources=sources)
