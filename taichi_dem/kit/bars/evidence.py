"""What runs tell of a goal at falling steps and from seed to seed: value and errors."""

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from taichi_dem.kit.bars.answer import ErrorParts, largest
from taichi_dem.kit.bars.chance import clusters_of, mean_and_deviation, t_quantile
from taichi_dem.kit.bars.runs import BaseRuns, Question
from taichi_dem.kit.bars.step import SUPPORTED, StepError, step_error

#: Levels at which twins are run, at most: chance by the luck of when a step ends falls with it.
TRIED = 3
#: Share of what is allowed below which a single twin is enough to know of chance.
_NEGLIGIBLE = 0.25
#: Runs there must be of each end, on average, to call it one: more ends are a distribution.
_OF_EACH = 3


@dataclass(frozen=True, eq=False)
class GoalEstimate:
    """Value of a goal and its bar by source, (places,) each. allowed: a half-width as asked.

    power: of 1 / error, with which the cost grows.
    """

    goal: Any
    value: np.ndarray
    parts: ErrorParts
    allowed: float
    power: float = 2.0

    @property
    def is_told(self) -> bool:
        """Whether value and bar are numbers."""
        return not np.isnan(self.value + self.parts.total).any()

    @property
    def excess(self) -> float:
        """Half-width of the bar over what is allowed; infinite where one is no number."""
        total = largest(self.parts.total)
        if not math.isfinite(total + self.allowed):
            return math.inf
        return total / self.allowed if self.allowed > 0.0 else float(total > 0.0) * 1e9


class Evidence:
    """Runs of a question at levels of the step, and what they tell.

    levels: ever finer. seeds: runs at each level, or at one level where a single run is asked for.
    parted: whether twins at a level before differed too much. why: why no more runs are made.
    """

    def __init__(self, question: Question, runs: BaseRuns, first: float):
        self.question, self.runs = question, runs
        self.levels, self.seeds, self.twin_level = [first], runs.seeds, first
        self.parted, self.why = False, ""

    def made(self, level):
        """Whether runs at a level do not diverge."""
        first = self.runs.seeds
        return all(len(self.runs.sample(goal, level, first)) for goal in self.question.goals)

    @property
    def each(self):
        """Runs that a value is made of."""
        return self.seeds if self.runs.averaged else 1

    @property
    def is_pair(self):
        """Whether two runs are all that the bar has: twins without events differ by rounding."""
        return len(self.levels) == 2 and not (self.eventful and self.seeds > 1)

    @property
    def eventful(self):
        """Whether chance may decide anything."""
        return self.runs.eventful(self.levels[-1])

    def smooth(self, goal):
        """Whether the declared order of the step's error may be trusted."""
        # What breaks or touches does so within a step, and a largest speed depends on where samples
        # fall: then only first order is trusted.
        return self.runs.is_smooth(goal) and not self.runs.eventful(self.levels[-1])

    def allowed(self, goal):
        """Half-width of a bar as asked."""
        size = largest(self.value(goal, self.levels[-1]))
        return max(self.question.tolerance * size, 2.0 * self.runs.rounding(goal))

    def value(self, goal, level):
        """Value at a level, (places,); where one run means little, the mean over its seeds."""
        if not self.runs.averaged:
            return self.runs.sample(goal, level, 1)[0]
        return self.statistics(goal, level)[0]

    def statistics(self, goal, level):
        """Means and standard deviations over the seeds at a level, (2, places)."""
        values = self.runs.sample(goal, level, self.seeds)
        return np.array([mean_and_deviation(column) for column in values.T]).T

    def errors(self, goal) -> list[StepError]:
        """Error of the step, one a place."""
        values = np.array([self.value(goal, level) for level in self.levels])
        # An output that changes by less than a usual body's may do so by chance.
        least, smooth = self.runs.least(goal, *self.levels[-2:]), self.smooth(goal)
        whole = float(self.is_whole(goal))
        parts: Any = partial(
            step_error,
            declared=self.runs.order if smooth else 1.0,
            steps=[self.runs.step(level) for level in self.levels],
            smooth=smooth,
            confidence=self.question.confidence,
        )
        return [parts(some, least=max(least * abs(some[-1]), whole)) for some in values.T]

    def step(self, goal):
        """Half-width by the step, (places,)."""
        return np.array([errors.error for errors in self.errors(goal)])

    def is_whole(self, goal):
        """Whether a goal is a whole number that a finer run may change by one."""
        return self.runs.is_whole(goal, self.levels[-1])

    def estimate(self, goal) -> GoalEstimate:
        """Estimate of a goal, after runs that tell of chance."""
        runs, last, power = self.runs, self.levels[-1], 2.0
        step, errors = self.step(goal), self.errors(goal)[0]
        chance = self._spread(goal) if self.eventful or runs.averaged else np.zeros_like(step)
        allowed, value = self.allowed(goal), self.value(goal, last)
        if self.is_pair:
            step = np.maximum(step, SUPPORTED * (self.question.tolerance * largest(value)))
        # A value that is zero is off by what its rounding shows.
        size = np.abs(value)
        step = np.maximum(step, np.where(size <= runs.rounding(goal), size, 0.0))
        if not runs.averaged:
            power = 1.0 / (errors.order if errors.regular else 1.0 if self.eventful else runs.order)
        parts = ErrorParts(step=step, chance=chance, sampling=runs.sampling(goal, last, self.seeds))
        if step.any() and len(self.levels) > 2 and not self.why:
            parts = self._with_solver(goal, parts)
        return GoalEstimate(goal, value, parts, allowed, power)

    def _with_solver(self, goal, parts):
        """The parts with that of sweeps, which is seen once a second step was not enough."""
        sweeps = self.runs.solver(goal, self.levels[0])
        if sweeps is None:
            return parts
        sweeps = np.minimum(parts.step, sweeps * 2.0 ** (self.levels[0] - self.levels[-1]))
        rest = [_beside(*pair) for pair in zip(parts.step.tolist(), sweeps.tolist())]
        return replace(parts, step=np.array(rest), solver=sweeps)

    def _spread(self, goal):
        """Half-width by which runs that differ by chance spread, of one or of their mean."""
        runs, level, averaged = self.runs, self.twin_level, self.runs.averaged
        if runs.few == 1:
            return np.zeros_like(self.value(goal, level))
        if self.seeds == 1:
            tolerance, (coarse, fine) = _NEGLIGIBLE * self.question.tolerance, self.levels[-2:]
            if not averaged and not self.parted and runs.is_calm(coarse, fine, tolerance):
                return np.zeros_like(self.value(goal, level))
            if not self.affords(1.0, level):
                return np.full_like(self.value(goal, level), math.inf)
            self.seeds = 2
        if self.seeds == 2 and not averaged and goal.kind != "count":
            values, allowed = runs.sample(goal, level, 2), self.allowed(goal)
            apart = (
                abs(values[1] - values[0]) if len(values) > 1 else np.full_like(values[0], math.inf)
            )
            bar = t_quantile(self.question.confidence, 1) * apart
            is_last = len(self.levels) > TRIED
            if largest(bar) <= _NEGLIGIBLE * allowed or (largest(apart) > allowed and not is_last):
                return bar
        if self.seeds < runs.few and self.affords(float(runs.few - self.seeds), level):
            self.seeds = runs.few
        spread = self.deviation(goal) * t_quantile(self.question.confidence, self.seeds - 1)
        # Of a single value the truth is another one, as far from the mean.
        return spread / math.sqrt(self.seeds) if averaged else math.sqrt(2.0) * spread

    def deviation(self, goal):
        """Standard deviation of single runs; infinite where one diverged."""
        deviation = self.statistics(goal, self.twin_level)[1]
        whole = len(self.runs.sample(goal, self.twin_level, self.seeds)) == self.seeds
        return deviation if whole else np.full_like(deviation, math.inf)

    def affords(self, runs, level):
        """Whether the budget lets some runs as long as that at a level be made."""
        needed = runs * self.runs.cost[level]
        if self.runs.seconds + needed <= self.question.budget_s:
            return True
        self.why = f"the budget is spent: the next runs would take {needed:.2g} s"
        return False

    def clusters(self, found):
        """Values of the seeds, and their numbers by outcome where they have a few; else nothing."""
        runs, several = self.runs, largest(found.parts.chance) > found.allowed
        if not runs.divides or np.size(found.value) != 1 or not (runs.averaged or several):
            return ()
        level = self.levels[-1] if runs.averaged else self.twin_level
        values = runs.sample(found.goal, level, self.seeds)[:, 0]
        clusters = clusters_of(values, 0.0, 0.5 * found.allowed)
        return (values, clusters) if 2 <= len(clusters) <= len(values) // _OF_EACH else ()


def _beside(whole, part):
    """Root of the difference of two squares, without squares, which may be beyond all numbers."""
    if whole == part:
        return 0.0
    return math.sqrt(whole - part) * math.hypot(math.sqrt(whole), math.sqrt(part))
