"""The way to an answer: which run is made next, and when the bar is narrow enough."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from taichi_dem.accuracy.runs import Job, Runs
from taichi_dem.accuracy.sources import Beside
from taichi_dem.kit.bars.answer import (
    Answer,
    ErrorParts,
    Plan,
    branched,
    branches_of,
    cost_curve,
    doubted,
)
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import clusters_of, mean_and_deviation, t_quantile
from taichi_dem.kit.bars.step import StepError, step_error
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import told_apart
from taichi_dem.report.energy_balance import open_account

#: Halvings of the step until one is stable, and from there on; of one refinement.
_MOST_COARSE, _MOST_FINE, _MOST_AT_ONCE = 6, 7, 2
#: Share of what is allowed below which a single twin is enough to know of chance, and a difference
#: of two in standard deviations of one, at most, in 95 of 100 cases.
_NEGLIGIBLE, _TWO = 0.25, 2.8
#: Runs of which a spread is taken at first, and at most.
_FEW, _MANY = 6, 96
#: Runs there must be of each end, on average, to call it one: more ends are a distribution.
_OF_EACH = 3
#: Spread over what is allowed from which on no mean of runs has it.
_HOPELESS = 1e6
#: Share of all bodies that a run with all effects is compared with, at least.
_LEAST_AWAKE = 1e-3


class Search:
    """Makes runs until the bar is as narrow as asked, or cannot be, or the budget is spent.

    budget: CPU seconds after which no run is begun. first: level to begin with.
    """

    def __init__(
        self, job: Job, budget: float, listen: Callable[[Any], Any] | None, first: int = 0
    ):
        self.job, self.budget = job, budget
        self.runs = Runs(job, listen)
        self.levels, self.why = [first], ""
        # Twins so far, and their level.
        self.count, self.twins_at = 0, first

    def answer(self) -> Answer:
        """The answer, after all runs that it needs."""
        self._begin()
        parts, pilot_s = self._parts(), self.runs.seconds
        while not self.why and parts.total > self._allowed:
            self._reduce(parts)
            parts = self._parts()
        job, last = self.job, self.levels[-1]
        sources, parts = self._budget(parts)
        parting = self.runs.parting(self.twins_at) if parts.chance > self._allowed else math.inf
        words, spent = job.in_words(last), self.runs.seconds - pilot_s
        short = f"{100.0 * job.tolerance:g} % was not reached: {self.why}" if self.why else ""
        made = Answer(
            goal=job.goal.name,
            unit=job.goal.unit,
            value=self._value(last),
            parts=parts,
            tolerance=job.tolerance,
            confidence=job.confidence,
            plan=Plan(words, self.runs.count, pilot_s, spent, last - 1, parting),
            result=self.runs.results[last],
            cost_curve=self._cost_curve(),
            shortfall=short,
            sources=sources,
        )
        made = self._branched(made) if parts.chance > self._allowed else made
        return doubted(made, *self._doubts(self.runs.results[last].report))

    def _budget(self, parts: ErrorParts) -> tuple[tuple[Source, ...], ErrorParts]:
        """All sources of error, and the parts with those beside the step that were measured.

        No step mends these: where one of them is wider than allowed, that is said.
        """
        runs, first, last = self.runs, self.levels[0], self.levels[-1]
        halves = f"half of a step: {counted(runs.count, 'run')}"
        twins = counted(self.count, "twin") if self.count else "nothing lets twins part"
        found = [
            Source("step", math.hypot(parts.step, parts.solver), halves, runs.seconds),
            Source("chance", parts.chance, twins, 0.0),
        ]
        report = runs.results[last].report
        beside = Beside(self.job, runs, first, report, lambda more: self._affords(more, first))
        found += beside.sources()
        measured = {one.name: one.error for one in found[2:] if one.measured and one.error}
        for name, error in measured.items():
            if error > self._allowed and not self.why:
                self.why = f"the {name} moves it by {self._percent(error)}, which no step mends"
        return tuple(found), replace(parts, **measured)

    def _branched(self, made: Answer) -> Answer:
        """The answer with its branches, where twins come to a few ends; else as it is."""
        values = np.array(self._sample(self.twins_at))
        clusters = clusters_of(values, 0.0, 0.5 * self._allowed)
        few = 2 <= len(clusters) <= len(values) // _OF_EACH
        if self.job.goal.averaged or not few:
            return made
        branches = branches_of(values, clusters, range(len(values)), self._step().error, 1.0)
        ends = "that differ by one rounding came to {} ends"
        return branched(made, branches, made.parts.step, "run", ends)

    def _begin(self):
        """Find the longest step that is stable, and go on to half of it."""
        while self.runs.value(self.levels[0]) is None:
            self.levels[0] += 1
            if self.levels[0] > _MOST_COARSE:
                raise SimulationDiverged(self.runs.failure)
        first, needed = self.levels[0], self.runs.seconds + 2.0 * self.runs.cost[self.levels[0]]
        if needed > self.budget:
            got, least = told_apart(self.budget, needed, 2)
            raise InputError(f"budget_s must leave time for two runs, {least} s here, got {got}")
        if self.runs.value(first + 1) is None:
            raise SimulationDiverged(self.runs.failure)
        self.levels.append(first + 1)
        self.twins_at = first

    @property
    def _allowed(self):
        return self.job.tolerance * abs(self._value(self.levels[-1]))

    def _sample(self, level):
        """Values of a run and its twins that did not diverge, as many as were asked for."""
        found = (self.runs.value(level, twin) for twin in range(self.count + 1))
        return [value for value in found if value is not None]

    def _value(self, level):
        """Value at a level; where one run means little, the mean over a run and its twins."""
        if not self.job.goal.averaged:
            return self.runs.value(level)
        return mean_and_deviation(self._sample(level))[0]

    def _step(self, count: int | None = None) -> StepError:
        """Error of the step, and of sweeps whose tolerance falls with it; count: of levels."""
        levels = self.levels[:count]
        values = [self._value(level) for level in levels]
        # An output that changes by less than a usual body's may do so by chance.
        usual = {"count": self.runs.leap, "extreme": self.runs.peak_change}
        change = usual.get(self.job.goal.kind, self.runs.change)
        # What breaks or touches does so within a step, and where the times of samples lie by a
        # largest speed is chance: only first order is trusted then.
        smooth = self.job.goal.kind == "value" and not self._eventful
        return step_error(
            values,
            self.job.declared if smooth else 1.0,
            [2.0**-level for level in levels],
            least=change(*levels[-2:]) * abs(values[-1]),
            smooth=smooth,
            confidence=self.job.confidence,
        )

    def _parts(self):
        """Half-widths of the bar by source; that of sweeps once a second step was not enough."""
        step, first = self._step().error, self.levels[0]
        chance = self._spread() if self._eventful or self.job.goal.averaged else 0.0
        if len(self.levels) == 2 or self.why or not self.job.solves:
            return ErrorParts(step=step, chance=chance)
        tight = self.runs.value(first, 0, True)
        sweeps = math.inf if tight is None else abs(tight - self.runs.value(first))
        sweeps = min(step, sweeps * 2.0 ** (first - self.levels[-1]))
        return ErrorParts(step=_beside(step, sweeps), solver=sweeps, chance=chance)

    def _spread(self):
        """Half-width by which runs that differ by one rounding spread, of one or of their mean.

        To halve the step disturbs a run far more than a rounding does: where nothing comes of
        that, nothing is there that could let twins part.
        """
        coarse, averaged = self.twins_at, self.job.goal.averaged
        if self.count == 0:
            if not averaged and self._is_calm():
                return 0.0
            if not self._affords(1.0, coarse):
                return math.inf
            self.count = 1
        if self.count == 1 and not averaged:
            here, twin = self.runs.value(coarse), self.runs.value(coarse, 1)
            apart = math.inf if twin is None else _TWO * abs(twin - here)
            if apart <= _NEGLIGIBLE * self._allowed:
                return apart
        if self.count < _FEW - 1 and self._affords(_FEW - 1.0 - self.count, coarse):
            self.count = _FEW - 1
        found = self._sample(coarse)
        if len(found) <= self.count:
            return math.inf
        spread = mean_and_deviation(found)[1] * t_quantile(self.job.confidence, len(found) - 1)
        return spread / math.sqrt(len(found)) if averaged else spread

    def _is_calm(self):
        """Whether half the step moves a usual body by little, and breaks the same faces."""
        last = self.levels[-2:]
        change = self.runs.change(*last)
        return change <= _NEGLIGIBLE * self.job.tolerance and self.runs.same_breaks(*last)

    @property
    def _eventful(self):
        """Whether anything broke, touched or slipped: then one rounding may decide."""
        report = self.runs.results[self.levels[-1]].report
        return report.broken_faces > 0 or report.pair_evaluations > 0 or bool(report.bond_slip)

    def _reduce(self, parts):
        """Make the runs that narrow the largest part, or say why there are none."""
        averaged = self.job.goal.averaged
        if not averaged and len(self.levels) > 2 and parts.chance > self._allowed:
            self.why = self._chaotic()
        elif averaged and parts.chance > 0.5 * parts.total:
            self._add_twins(parts)
        else:
            self._refine(parts)

    def _chaotic(self):
        """Why no single run answers, and what would."""
        found = self._sample(self.twins_at)
        if len(found) <= self.count:
            return f"runs that differ by one rounding diverged: {self.runs.failure}"
        width = t_quantile(self.job.confidence, math.inf) * mean_and_deviation(found)[1]
        words = f"runs that differ by one rounding spread by {self._percent(width)}"
        if not self._allowed or not width / self._allowed < _HOPELESS:
            return words
        needed = max(2, math.ceil(2.0 * (width / self._allowed) ** 2))
        seconds = needed * sum(self.runs.cost[level] for level in self.levels[:2])
        return (
            f"{words}. The mean of some {needed} of them may have it, in {seconds:.2g} s: ask for "
            "goal.mean()"
        )

    def _add_twins(self, parts):
        if self.count + 1 >= _MANY:
            self.why = f"the mean of {self.count + 1} runs has {self._percent(parts.total)}"
        elif self._affords((self.count + 1) * len(self.levels), self.levels[0]):
            self.count = min(_MANY - 1, 2 * self.count + 1)

    def _refine(self, parts):
        """Go on to half the step, or to the one that the order of a smooth run calls for."""
        last, more = self.levels[-1], 1
        if last - self.levels[0] >= _MOST_FINE:
            self.why = f"half of a step of {self.job.method(last).dt0:.2g} s changes as much"
            return
        if not self._eventful:
            wanted = _halvings(parts.total, self._allowed, self.job.declared)
            more = int(min(_MOST_AT_ONCE, max(1, wanted)))
        while more > 1 and not self._affords(2.0**more, last):
            more, self.why = more - 1, ""
        if self._affords(2.0**more * (self.count + 1 if self.job.goal.averaged else 1), last):
            if self.runs.value(last + more) is None:
                self.why = f"a smaller step diverged: {self.runs.failure}"
            else:
                self.levels.append(last + more)
                if not self.job.goal.averaged and parts.chance > self._allowed:
                    # At the step before, twins may have parted by the step alone.
                    self.count, self.twins_at = 0, last

    def _affords(self, runs, level):
        """Whether the budget lets some runs as long as that at a level be made."""
        needed = runs * self.runs.cost[level]
        if self.runs.seconds + needed > self.budget:
            self.why = f"the budget is spent: the next runs would take {needed:.2g} s"
        return not self.why

    def _percent(self, error):
        size = abs(self._value(self.levels[-1]))
        unit = self.job.goal.unit
        return f"{100.0 * error / size:.2g} %" if size else f"{error:.2g} {unit} about zero"

    def _doubts(self, report):
        """Reasons to doubt the finest run, and what would settle each."""
        yield from open_account(report.energy_balance, report.round_off_J)
        found = report.certificate
        if found is not None and not found.holds:
            seconds = self.runs.seconds / max(_LEAST_AWAKE, 1.0 - found.asleep)
            why = f"the certificate of its run does not hold, as {found.failure}"
            yield f"{why}, about {seconds:.2g} s"

    def _cost_curve(self):
        """Cost of other tolerances: what the runs cost that were enough for them, or would be."""
        levels, size = self.levels, abs(self._value(self.levels[-1]))
        others = self.runs.seconds - sum(self.runs.cost[level] for level in levels)
        paid = others + np.cumsum([self.runs.cost[level] for level in levels])
        stages = [(self._step(count), paid[count - 1]) for count in range(2, len(levels) + 1)]

        def cost(tolerance):
            for step, seconds in stages:
                if step.error <= tolerance * size:
                    return float(seconds), True
            unseen = 1.0 if self._eventful else self.job.declared
            more = _halvings(step.error, tolerance * size, step.order if step.regular else unseen)
            return float(seconds) * 2.0**more, False

        return tuple(cost_curve(self.job.tolerance, cost))


def _beside(whole, part):
    """Root of the difference of two squares, without squares, which may be beyond all numbers."""
    if whole == part:
        return 0.0
    return math.sqrt(whole - part) * math.hypot(math.sqrt(whole), math.sqrt(part))


def _halvings(error, allowed, order):
    """Halvings of a step, 0 or more, that bring an error of an order to what is allowed."""
    if error <= allowed:
        return 0
    ratio = error / allowed if allowed else math.inf
    return math.inf if math.isinf(ratio) else math.ceil(math.log2(ratio) / order)
