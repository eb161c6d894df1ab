"""Search for an answer: which run comes next, and when the bar is narrow enough."""

import math
from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import numpy as np

from taichi_dem.accuracy.runs import Job, Runs, extreme_doubts
from taichi_dem.accuracy.sources import MANY, Beside, Twins, awake_price
from taichi_dem.kit.bars.answer import (
    Answer,
    ErrorParts,
    Plan,
    cost_curve,
    doubted,
    share_in_words,
    with_source,
)
from taichi_dem.kit.bars.budget import Source
from taichi_dem.kit.bars.chance import mean_and_deviation, t_quantile
from taichi_dem.kit.bars.step import SUPPORTED, StepError, step_error
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import told_apart
from taichi_dem.report.energy_balance import OPEN, open_account, unexplained_share

#: Halvings of the step until one is stable, and from there on; of one refinement.
_MOST_COARSE, _MOST_FINE, _MOST_AT_ONCE = 6, 7, 2
#: Levels at which twins are run, at most: chance by the luck of when a step ends falls with it.
_TRIED = 3
#: Spread over what is allowed from which on no mean of runs has it.
_HOPELESS = 1e6


class Search:
    """Makes runs until the bar is narrow enough or cannot get narrower, or the budget is spent."""

    def __init__(
        self, job: Job, budget: float, listen: Callable[[Any], Any] | None, first: float = 0
    ):
        self.job, self.budget = job, budget
        self.runs = Runs(job, listen)
        self.levels: list[float] = [first]
        self.twins = Twins(job, self.runs, self._affords)
        # Why no more is done, and whether as single runs part at every level.
        self.why, self.hopeless = "", False

    def answer(self) -> Answer:
        """The answer, after all runs that it needs."""
        try:
            return self._answered()
        finally:
            # Else the next question waits until the garbage of this one is collected.
            self.runs.release()

    def _answered(self):
        self._begin()
        if self._is_pair and not self._eventful:
            self._confirm()
        parts, pilot_s = self._parts(), self.runs.seconds
        while not self.why and parts.total > self._allowed:
            self._reduce(parts)
            parts = self._parts()
        job, last, beside = self.job, self.levels[-1], tuple(self._beside().sources())
        parting = self.runs.parting(self.twins.level) if parts.chance > self._allowed else math.inf
        short = f"{100.0 * job.tolerance:g} % was not reached: {self.why}" if self.why else ""
        doubts = tuple(self._doubts(parts.total))
        words, spent = job.in_words(last), self.runs.seconds - pilot_s
        made = Answer(
            goal=job.goal.name,
            unit=job.goal.unit,
            value=self._value(last),
            parts=parts,
            tolerance=job.tolerance,
            confidence=job.confidence,
            plan=Plan(words, self.runs.count, pilot_s, spent, math.ceil(last) - 1, parting),
            result=self.runs.results[last],
            cost_curve=self._cost_curve(parts.chance),
            shortfall=short,
            sources=self._sources(parts),
        )
        if parts.chance > self._allowed:
            made = self.twins.branched(made, self._allowed, self._step().error)
        made = reduce(with_source, beside, made)
        return doubted(made, *doubts)

    def _sources(self, parts):
        """Sources of error that runs of this question show, with the CPU time of all of them."""
        runs = self.runs
        falling = f"{counted(runs.count, 'run')} at falling steps"
        if self._is_pair:
            falling = "2 runs at falling steps, a third of the tolerance at least"
        twins = counted(self.twins.count, "twin") if self.twins.count else "nothing can split twins"
        step = Source("step", math.hypot(parts.step, parts.solver), falling, runs.seconds)
        return step, Source("chance", parts.chance, twins, 0.0)

    def _beside(self):
        first, report = self.levels[0], self.runs.results[self.levels[-1]].report
        affords = partial(self._affords, level=first)
        return Beside(self.job, self.runs, first, report, affords, self._eventful)

    def _begin(self):
        while self.runs.value(self.levels[0]) is None:
            self.levels[0] += 1
            if self.levels[0] > _MOST_COARSE:
                raise SimulationDiverged(self.runs.failure)
        first = self.levels[0]
        # By little shorter steps, only what changes smoothly tells its error.
        second = self.job.nearby(first) if self._smooth else first + 1
        needed = self.runs.seconds + 2.0 ** (second - first) * self.runs.cost[first]
        if needed > self.budget:
            got, least = told_apart(self.budget, needed, 2)
            raise InputError(f"budget_s must be at least {least} s here, for two runs, got {got}")
        if self.runs.value(second) is None:
            raise SimulationDiverged(self.runs.failure)
        self.levels.append(second)
        self.twins.level = first

    def _confirm(self):
        """Make a third run where two have the same value: another step may have another one."""
        last, third = self.levels[-1], self.job.nearby(self.levels[-1])
        agree = self._allowed > 0.0 and self._step().error == 0.0
        if agree and self._affords(2.0 ** (third - last), last):
            self.levels += [third] * (self.runs.value(third) is not None)
        # What is not confirmed has the bar of two runs.
        self.why = ""

    @property
    def _is_pair(self):
        """Whether two runs are all that the bar has: twins without events differ by rounding."""
        return len(self.levels) == 2 and not (self._eventful and self.twins.count)

    @property
    def _allowed(self):
        return self.job.tolerance * abs(self._value(self.levels[-1]))

    def _value(self, level):
        """Value at a level; where one run means little, the mean over a run and its twins."""
        if not self.job.goal.averaged:
            return self.runs.value(level)
        return mean_and_deviation(self.twins.sample(level))[0]

    def _step(self, count: int | None = None) -> StepError:
        levels = self.levels[:count]
        values = [self._value(level) for level in levels]
        # An output that changes by less than a usual body's may do so by chance.
        usual = {"count": self.runs.leap, "extreme": self.runs.peak_change}
        change = usual.get(self.job.goal.kind, self.runs.change)
        least = change(*levels[-2:]) * abs(values[-1])
        if self._counts_breaks:
            least = max(least, 1.0)
        return step_error(
            values,
            self.job.declared if self._smooth else 1.0,
            [self.job.method(level).dt0 for level in levels],
            least=least,
            smooth=self._smooth,
            confidence=self.job.confidence,
        )

    def _parts(self):
        """Half-widths of the bar by source; that of sweeps once a second step was not enough."""
        step, first = self._step().error, self.levels[0]
        chance = self._spread() if self._eventful or self.job.goal.averaged else 0.0
        if self._is_pair:
            step = max(step, SUPPORTED * self._allowed)
        if not step or len(self.levels) == 2 or self.why or not self.job.solves:
            return ErrorParts(step=step, chance=chance)
        tight = self.runs.value(first, 0, True)
        sweeps = math.inf if tight is None else abs(tight - self.runs.value(first))
        sweeps = min(step, sweeps * 2.0 ** (first - self.levels[-1]))
        return ErrorParts(step=_beside(step, sweeps), solver=sweeps, chance=chance)

    def _spread(self):
        return self.twins.spread(self.levels, self._allowed, len(self.levels) > _TRIED)

    @property
    def _smooth(self):
        """Whether the declared order of the step's error may be trusted."""
        # What breaks or touches does so within a step, and a largest speed depends on where samples
        # fall: then only first order is trusted.
        return self.job.goal.kind == "value" and not self._eventful

    @property
    def _eventful(self):
        """Whether anything broke, touched or slipped: then one rounding may decide."""
        return self.runs.eventful(self.levels[-1])

    @property
    def _counts_breaks(self):
        """Whether a whole number is asked for where faces broke: a finer run may break one more."""
        report = self.runs.results[self.levels[-1]].report
        return self.job.goal.kind == "count" and report.broken_faces > 0

    def _reduce(self, parts):
        """Make the runs that narrow the largest part, or say why there are none."""
        averaged = self.job.goal.averaged
        if not averaged and len(self.levels) > _TRIED and parts.chance > self._allowed:
            self.why, self.hopeless = self._chaotic(), True
        elif averaged and parts.chance > 0.5 * parts.total:
            self._add_twins(parts)
        else:
            self._refine(parts)

    def _chaotic(self):
        """Why no single run answers, and what would."""
        width = t_quantile(self.job.confidence, math.inf) * self.twins.deviation()
        if math.isinf(width):
            return f"runs that differ by chance diverged: {self.runs.failure}"
        words = f"runs that differ by chance spread by {self._percent(width)}"
        if not self._allowed or not width / self._allowed < _HOPELESS:
            return words
        needed = max(2, math.ceil(2.0 * (width / self._allowed) ** 2))
        seconds = needed * sum(self.runs.cost[level] for level in self.levels[:2])
        return (
            f"{words}. The mean of about {needed} runs may reach it, in {seconds:.2g} s: ask "
            "for goal.mean()"
        )

    def _add_twins(self, parts):
        count = self.twins.count + 1
        if count >= MANY:
            self.why = f"the mean of {count} runs has {self._percent(parts.total)}"
        elif self._affords(count * len(self.levels), self.levels[0]):
            self.twins.count = min(MANY, 2 * count) - 1

    def _refine(self, parts):
        """Go on to half the step, or to the one that the order of a smooth run calls for."""
        last, more = self.levels[-1], 1
        if self._counts_breaks and self._allowed < 1.0:
            self.why = "the number of broken faces is known to one at best"
            return
        if last - self.levels[0] >= _MOST_FINE:
            self.why = f"halving the step of {self.job.method(last).dt0:.2g} s changes as much"
            return
        if not self._eventful:
            wanted = _halvings(parts.total, self._allowed, self.job.declared)
            more = int(min(_MOST_AT_ONCE, max(1, wanted)))
        while more > 1 and not self._affords(2.0**more, last):
            more, self.why = more - 1, ""
        each = self.twins.count + 1 if self.job.goal.averaged else 1
        if self._affords(2.0**more * each, last):
            if self.runs.value(last + more) is None:
                self.why = f"a smaller step diverged: {self.runs.failure}"
            else:
                self.levels.append(last + more)
                if not self.job.goal.averaged and parts.chance > self._allowed:
                    self.twins.go_to(last)

    def _affords(self, runs, level):
        """Whether the budget lets some runs as long as that at a level be made."""
        needed = runs * self.runs.cost[level]
        if self.runs.seconds + needed <= self.budget:
            return True
        self.why = f"the budget is spent: the next runs would take {needed:.2g} s"
        return False

    def _percent(self, error):
        return share_in_words(error, self._value(self.levels[-1]), self.job.goal.unit)

    def _doubts(self, bar):
        first, last = self.levels[0], self.levels[-1]
        report = self.runs.results[last].report
        if self.job.goal.kind == "extreme":
            yield from extreme_doubts(self.runs, first, last, bar, self._affords)
        account, round_off = report.energy_balance, report.round_off_J
        if unexplained_share(account, round_off) > OPEN:
            yield from open_account(account, round_off)
        found = report.certificate
        if found is not None and not found.holds:
            why = f"the certificate of its run does not hold, as {found.failure}"
            yield f"{why}, about {awake_price(self.runs, found):.2g} s"

    def _cost_curve(self, chance):
        """Cost of other tolerances: what the runs cost that were enough for them, or would be."""
        levels, size = self.levels, abs(self._value(self.levels[-1]))
        others = self.runs.seconds - sum(self.runs.cost[level] for level in levels)
        paid = others + np.cumsum([self.runs.cost[level] for level in levels])
        stages = [(self._step(count), paid[count - 1]) for count in range(2, len(levels) + 1)]

        def cost(tolerance):
            for step, seconds in stages:
                if max(step.error, chance) <= tolerance * size:
                    return float(seconds), True
            unseen = 1.0 if self._eventful else self.job.declared
            order = step.order if step.regular else unseen
            more = _halvings(max(step.error, chance), tolerance * size, order)
            return float(seconds) * 2.0**more, False

        curve = cost_curve(self.job.tolerance, cost)
        return tuple(one for one in curve if not self.hopeless or one.tolerance * size >= chance)


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
