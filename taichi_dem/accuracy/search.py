"""The way to an answer: which run is made next, and when the bar is narrow enough."""

import math
from collections.abc import Callable
from typing import Any, Optional

import numpy as np

from taichi_dem.accuracy.job import Job
from taichi_dem.accuracy.runs import Runs
from taichi_dem.kit.accuracy.answer import Answer, ErrorParts, Expense, Plan
from taichi_dem.kit.accuracy.step_error import StepError, step_error
from taichi_dem.kit.accuracy.student import t_quantile
from taichi_dem.kit.errors import SimulationDiverged

#: Halvings of the step until one is stable, and from there on.
_MOST_COARSE, _MOST_FINE = 4, 6
#: Share of what is allowed below which two runs are enough to know of chance, and their difference
#: in standard deviations of one, at most, in 95 of 100 cases.
_NEGLIGIBLE, _TWO = 0.25, 2.8
#: Runs of which a spread is taken at first, and at most.
_FEW, _MANY = 4, 32
#: Tolerances of which the cost is told.
_TOLERANCES = (0.1, 0.03, 0.01, 0.003)


class Search:
    """Makes runs until the bar is as narrow as asked, or cannot be, or the budget is spent.

    budget: CPU seconds after which no run is begun.
    """

    def __init__(self, job: Job, budget: float, listen: Optional[Callable[[Any], Any]]):
        self.job, self.budget = job, budget
        self.methods = job.methods()
        self.runs = Runs(job, self.methods, listen)
        self.first, self.last, self.count = 0, 1, 1
        self.why = ""

    def answer(self) -> Answer:
        """The answer, after all runs that it needs."""
        self._begin()
        parts, pilot_s = self._parts(), self.runs.seconds
        while not self.why and parts.total > self._allowed:
            self._reduce(parts)
            parts = self._parts()
        plan = Plan(
            self.methods.in_words(self.last),
            self.runs.count,
            pilot_s,
            self.runs.seconds - pilot_s,
        )
        job = self.job
        return Answer(
            goal=job.goal.name,
            unit=job.goal.unit,
            value=self._value(self.last),
            parts=parts,
            tolerance=job.tolerance,
            confidence=job.confidence,
            plan=plan,
            result=self.runs.results[self.last],
            cost_curve=self._cost_curve(),
            shortfall=self._shortfall(),
        )

    def _begin(self):
        """Find the longest step that is stable, and go on to half of it."""
        while self._single(self.first) is None:
            self.first += 1
            if self.first > _MOST_COARSE:
                raise SimulationDiverged(self.runs.failure)
        self.last = self.first + 1
        if self._single(self.last) is None:
            raise SimulationDiverged(self.runs.failure)

    @property
    def _allowed(self):
        return self.job.tolerance * abs(self._value(self.last))

    def _single(self, level, twin=0):
        return self.runs.value(level, twin)

    def _sample(self, level):
        """Values of a run and its twins that did not diverge, as many as were asked for."""
        found = (self._single(level, twin) for twin in range(self.count))
        return [value for value in found if value is not None]

    def _value(self, level):
        """Value at a level; of an averaged goal the mean over a run and its twins."""
        return float(
            np.mean(self._sample(level) if self.job.goal.averaged else [self._single(level)])
        )

    def _step(self) -> StepError:
        levels = range(self.first, self.last + 1)
        return step_error([self._value(level) for level in levels], self.methods.declared)

    def _parts(self):
        """Half-widths of the bar. What sweeps change at the coarsest step falls with the step."""
        solver = chance = 0.0
        if self._eventful:
            chance = self._spread()
            if self.methods.solves:
                tight, here = self.runs.value(self.first, 0, True), self._single(self.first)
                solver = math.inf if tight is None else abs(tight - here)
        finer = 2.0 ** (self.first - self.last)
        return ErrorParts(step=self._step().error, solver=solver * finer, chance=chance)

    def _spread(self):
        """Half-width by which runs that differ by one rounding spread, of one or of their mean.

        Two that agree to a small part of what is allowed are enough.
        """
        if self.count == 1:
            twin, here = self._single(self.first, 1), self._single(self.first)
            apart = math.inf if twin is None else _TWO * abs(twin - here)
            if apart <= _NEGLIGIBLE * self._allowed:
                return apart
            self.count = _FEW
        found = self._sample(self.first)
        if len(found) < _FEW:
            return math.inf
        spread = float(np.std(found, ddof=1)) * t_quantile(self.job.confidence, len(found) - 1)
        return spread / math.sqrt(len(found)) if self.job.goal.averaged else spread

    @property
    def _eventful(self):
        """Whether anything broke, touched or slipped: then one rounding may decide."""
        report = self.runs.results[self.last].report
        return report.broken_faces > 0 or report.pair_evaluations > 0 or bool(report.bond_slip)

    def _reduce(self, parts):
        """Make the runs that narrow the largest part, or say why there are none."""
        if max(parts.step, parts.solver) >= parts.chance:
            self._refine()
        elif not self.job.goal.averaged:
            self._give_up(
                f"runs that differ by one rounding spread by {self._percent(parts.chance)}: ask "
                "for the mean of many, goal.mean()"
            )
        elif self.count >= _MANY:
            self._give_up(
                f"the mean of {self.count} runs is known to {self._percent(parts.chance)}"
            )
        elif self._affords((self.last - self.first + 1) * self.count, self.first):
            self.count = min(_MANY, 2 * self.count)

    def _refine(self):
        if self.last - self.first >= _MOST_FINE:
            self._give_up(
                f"half of a step of {self.methods.at(self.last).dt0:.2g} s changes as much"
            )
        elif self._affords(2.0 * self.count, self.last):
            self.last += 1
            if self._single(self.last) is None:
                self.last -= 1
                self._give_up(f"half of the step diverged: {self.runs.failure}")

    def _affords(self, runs, level):
        """Whether the budget lets some runs as long as that at a level be made."""
        needed = runs * self.runs.cost[level]
        if self.runs.seconds + needed > self.budget:
            self._give_up(f"the budget is spent: the next runs would take {needed:.2g} s")
        return not self.why

    def _give_up(self, why):
        self.why = why

    def _percent(self, error):
        return f"{100.0 * error / max(abs(self._value(self.last)), 1e-300):.2g} %"

    def _shortfall(self):
        return f"{100.0 * self.job.tolerance:g} % was not reached: {self.why}" if self.why else ""

    def _cost_curve(self):
        """Cost of other tolerances: by the step alone, from the levels that were run."""
        size, found = abs(self._value(self.last)), []
        step = self._step()
        order = step.order if step.regular else 1.0
        for tolerance in _TOLERANCES:
            ratio = max(step.error, 1e-300) / max(tolerance * size, 1e-300)
            more = max(1 - self.last + self.first, math.ceil(math.log2(ratio) / order))
            seconds = self.runs.seconds * 2.0**more
            found.append(Expense(tolerance, seconds, measured=tolerance == self.job.tolerance))
        return tuple(found)
