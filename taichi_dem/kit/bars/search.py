"""Search for answers: which run comes next, and when the bars are narrow enough."""

import math

import numpy as np

from taichi_dem.kit.bars.answer import Answer, largest, share_in_words
from taichi_dem.kit.bars.assembly import Assembly
from taichi_dem.kit.bars.chance import t_quantile
from taichi_dem.kit.bars.evidence import TRIED, Evidence, GoalEstimate
from taichi_dem.kit.bars.runs import BaseRuns, BudgetSpent, Question
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError, SimulationDiverged
from taichi_dem.kit.validation import told_apart

#: Halvings of the step until one is stable, and from there on; of one refinement.
_MOST_COARSE, _MOST_FINE, _MOST_AT_ONCE = 6, 7, 2
#: Spread over what is allowed from which on no mean of runs has it.
_HOPELESS = 1e6
# Rounds of further runs at most.
_MOST_ROUNDS = 24


class Search:
    """Makes runs until each bar is narrow enough or cannot get narrower, or the budget is spent.

    hopeless: whether single runs part at every level.
    """

    def __init__(self, question: Question, runs: BaseRuns, first: float = 0):
        self.known, self.hopeless, self.pilot_s = Evidence(question, runs, first), False, 0.0
        # CPU time after each round [s], and what was known then.
        self.rounds: list[tuple[float, list[GoalEstimate]]] = []

    def answers(self) -> tuple[Answer, ...]:
        """An answer to each goal, after all runs that they need."""
        try:
            self._narrow_all()
            return Assembly(self.known, self.rounds, self.pilot_s, self.hopeless).answers()
        finally:
            # Else the next question waits until the garbage of this one is collected.
            self.known.runs.release()

    def _narrow_all(self):
        known, state = self.known, {}
        try:
            self._begin()
            self.pilot_s = known.runs.seconds
            for _ in range(_MOST_ROUNDS):
                estimates = [known.estimate(goal) for goal in known.question.goals]
                if all(estimate.is_told for estimate in estimates):
                    self.rounds.append((known.runs.seconds, estimates))
                    seeds, state = known.seeds, known.runs.state()
                worst = max(estimates, key=lambda estimate: estimate.excess)
                if known.why or worst.excess <= 1.0 or not self._narrow(worst):
                    return
            known.why = f"{_MOST_ROUNDS} rounds of longer and more runs were made"
        except BudgetSpent as spent:
            if not self.rounds:
                self._refuse_budget(1.5 * spent.needed)
            known.why = f"the budget is spent: the next runs would take {spent.needed:.2g} s"
            known.seeds = seeds
            vars(known.runs).update(state)

    def _refuse_budget(self, needed):
        got, least = told_apart(self.known.question.budget_s, needed, 2)
        raise InputError(f"budget_s must be at least {least} s here, for two runs, got {got}")

    def _begin(self):
        runs, goals = self.known.runs, self.known.question.goals
        while not self.known.made(self.known.levels[0]):
            self.known.levels[0] += 1
            if self.known.levels[0] > _MOST_COARSE:
                raise SimulationDiverged(runs.failure)
        first = self.known.twin_level = self.known.levels[0]
        # By little shorter steps, only what changes smoothly tells its error.
        second = runs.nearby(first) if all(map(self.known.smooth, goals)) else first + 1
        needed = runs.seconds + 2.0 ** (second - first) * self.known.each * runs.cost[first]
        if second not in runs.cost and needed > self.known.question.budget_s:
            self._refuse_budget(needed)
        if not self.known.made(second):
            raise SimulationDiverged(runs.failure)
        self.known.levels.append(second)
        if self.known.is_pair and not self.known.eventful:
            self._confirm()

    def _confirm(self):
        """Make a third run where two have the same value: another step may have another one."""
        last, third = self.known.levels[-1], self.known.runs.nearby(self.known.levels[-1])
        some = [goal for goal in self.known.question.goals if self.known.allowed(goal) > 0.0]
        agree = any(not np.any(self.known.step(goal)) for goal in some)
        if agree and self.known.affords(2.0 ** (third - last), last):
            self.known.levels += [third] * self.known.made(third)
        # What is not confirmed has the bar of two runs.
        self.known.why = ""

    def _narrow(self, worst):
        """Make the runs that narrow the widest bar, or say why there are none; False for none."""
        runs, goal, total = self.known.runs, worst.goal, largest(worst.parts.total)
        chance, sampling = largest(worst.parts.chance), largest(worst.parts.sampling)
        if not worst.is_told or sampling > 0.7 * total:
            return self._resolve(goal)
        if runs.averaged and self.known.clusters(worst):
            return False
        if not runs.averaged and len(self.known.levels) > TRIED and chance > worst.allowed:
            self.known.why, self.hopeless = self._chaotic(worst), True
        elif runs.averaged and chance > 0.5 * total:
            self._add_seeds(worst)
        else:
            self._refine(worst)
        return True

    def _resolve(self, goal):
        if self.known.runs.resolve(goal):
            return True
        self.known.why = "neither frequencies nor cycles narrow what is left of the start"
        return False

    def _chaotic(self, worst):
        """Why no single run answers, and what would."""
        runs, allowed = self.known.runs, worst.allowed
        width = largest(self.known.deviation(worst.goal)) * t_quantile(
            self.known.question.confidence, math.inf
        )
        if math.isinf(width):
            return f"runs that differ by chance diverged: {runs.failure}"
        words = f"runs that differ by chance spread by {_percent(width, worst)}"
        if not allowed or not width / allowed < _HOPELESS:
            return words
        needed = max(2, math.ceil(2.0 * (width / allowed) ** 2))
        seconds = needed * sum(runs.cost[level] for level in self.known.levels[:2])
        return (
            f"{words}. The mean of about {needed} runs may reach it, in {seconds:.2g} s: ask "
            "for goal.mean()"
        )

    def _add_seeds(self, worst):
        more = self.known.runs.more(self.known.seeds)
        if more is None:
            total = _percent(worst.parts.total, worst)
            self.known.why = (
                f"the mean of {counted(self.known.seeds, self.known.runs.run)} is known to {total}"
            )
        elif self.known.affords(self.known.seeds * len(self.known.levels), self.known.levels[0]):
            self.known.seeds = more

    def _refine(self, worst):
        """Go on to half the step, or to the one that the order of a smooth run calls for."""
        last, more, runs = self.known.levels[-1], 1, self.known.runs
        if self.known.is_whole(worst.goal) and worst.allowed < 1.0:
            self.known.why = "the number of broken faces is known to one at best"
            return
        if last - self.known.levels[0] >= _MOST_FINE:
            self.known.why = f"halving the step of {runs.step(last):.2g} s still changes as much"
            return
        if not self.known.eventful:
            wanted = _halvings(largest(worst.parts.total), worst.allowed, runs.order)
            more = int(min(_MOST_AT_ONCE, max(1, wanted)))
        while more > 1 and not self.known.affords(2.0**more, last):
            more, self.known.why = more - 1, ""
        if not self.known.affords(2.0**more * self.known.each, last):
            return
        if not self.known.made(last + more):
            self.known.why = f"a smaller step diverged: {runs.failure}"
            return
        self.known.levels.append(last + more)
        if not runs.averaged and largest(worst.parts.chance) > self.known.allowed(worst.goal):
            # At the level before, twins may part by the step alone.
            self.known.seeds, self.known.twin_level, self.known.parted = 1, last, True


def _halvings(error, allowed, order):
    """Halvings of a step, 0 or more, that bring an error of an order to what is allowed."""
    if error <= allowed:
        return 0
    ratio = error / allowed if allowed else math.inf
    return math.inf if math.isinf(ratio) else math.ceil(math.log2(ratio) / order)


def _percent(error, value):
    return share_in_words(error, value.value, value.goal.unit)
