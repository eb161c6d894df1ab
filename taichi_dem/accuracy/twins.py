"""Twins of a run, which differ from it by chance alone: their spread and their outcomes."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.kit.bars.answer import Answer, branched, branches_of
from taichi_dem.kit.bars.chance import clusters_of, mean_and_deviation, t_quantile

#: Share of what is allowed below which a single twin is enough to know of chance.
NEGLIGIBLE = 0.25
#: Runs of which a spread is taken at first, and at most.
_FEW, MANY = 6, 96
#: Runs there must be of each end, on average, to call it one: more ends are a distribution.
_OF_EACH = 3


class Twins:
    """Twins of the run at one level; parted: whether those of a level before differed too much."""

    def __init__(self, job: Job, runs: Runs, affords: Callable[[float, float], bool]):
        self.job, self.runs, self.affords = job, runs, affords
        self.count, self.level, self.parted = 0, 0.0, False

    def go_to(self, level: float) -> None:
        """Begin anew at a finer level: at the one before, twins may part by the step alone."""
        self.count, self.level, self.parted = 0, level, True

    def sample(self, level: float) -> list[float]:
        """Values of a run and its twins that did not diverge, as many as were asked for."""
        found = (self.runs.value(level, twin) for twin in range(self.count + 1))
        return [value for value in found if value is not None]

    def spread(self, levels: Sequence[float], allowed: float, is_last: bool) -> float:
        """Half-width by which runs that differ by chance spread, of one or of their mean."""
        # Twins cannot separate if half the step breaks the same faces and hardly moves bodies.
        averaged = self.job.goal.averaged
        if self.count == 0:
            if not averaged and not self.parted and self._is_calm(*levels[-2:]):
                return 0.0
            if not self.affords(1.0, self.level):
                return math.inf
            self.count = 1
        if self.count == 1 and not averaged and self.job.goal.kind != "count":
            here, twin = self.runs.value(self.level), self.runs.value(self.level, 1)
            apart = math.inf if twin is None else abs(twin - here)
            bar = t_quantile(self.job.confidence, 1) * apart
            if bar <= NEGLIGIBLE * allowed or (apart > allowed and not is_last):
                return bar
        if self.count < _FEW - 1 and self.affords(_FEW - 1.0 - self.count, self.level):
            self.count = _FEW - 1
        spread = self.deviation() * t_quantile(self.job.confidence, self.count)
        # Of a single value the truth is another one, as far from the mean.
        return spread / math.sqrt(self.count + 1) if averaged else math.sqrt(2.0) * spread

    def _is_calm(self, coarse, fine):
        """Whether half the step moves a usual body by little, and breaks the same faces."""
        change = self.runs.change(coarse, fine)
        little = change <= NEGLIGIBLE * self.job.tolerance
        return little and self.runs.same_breaks(coarse, fine)

    def deviation(self) -> float:
        """Standard deviation of single runs; infinite where one diverged."""
        found = self.sample(self.level)
        return mean_and_deviation(found)[1] if len(found) > self.count else math.inf

    def branched(self, made: Answer, allowed: float, step: float) -> Answer:
        """The answer with its branches, where twins have a few outcomes; else unchanged."""
        values = np.array(self.sample(self.level))
        clusters = clusters_of(values, 0.0, 0.5 * allowed)
        few = 2 <= len(clusters) <= len(values) // _OF_EACH
        if self.job.goal.averaged or not few:
            return made
        branches = branches_of(values, clusters, range(len(values)), step, 1.0)
        ends = "that differ by chance had {} outcomes"
        return branched(made, branches, made.parts.step, "run", ends)
