"""Reduction of the error of goals: which scenes continue, until the bars are narrow enough."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

from ca_damper.accuracy.estimate import (
    Estimate,
    Readings,
    SeedValues,
    estimate,
    rounding_of,
    size_of,
)
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.runs import BudgetSpent, SceneKey, SceneRuns, SteadyRuns
from ca_damper.goals import Goal
from ca_damper.report.peak_search import Lattice, PeakSearch
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import told_apart

#: Steps by the finest: these show an order, and with those between the spread where there is none.
STEPS, BETWEEN = (1.0, 2.0, 4.0), (math.sqrt(2.0), 2.0 * math.sqrt(2.0))
# Halvings of a step without an order: it may only have been too coarse.
_MOST_HOPES = 1
# Most seeds there are.
_MOST_SEEDS = 96
# Cycles that a scene goes at least in the pilot and in the end.
_PILOT_CYCLES, _LEAST_CYCLES = 40, 64
# Drift that does not matter: as a share of the value in the pilot, of the tolerance in the end.
_PILOT_DRIFT, _DRIFT = 0.05, 0.2
_MOST_ROUNDS = 24
# Seeds by which the frequencies at a peak are judged.
_GRID_SEEDS = 3
# Frequencies that are added on either side of a peak.
_MOST_MARGIN = 5


class Search:
    """Runs of a job with steps of ``at.dt`` [s] and of 2 and 4 times as much."""

    def __init__(self, job: Job, runs: SceneRuns, coarse: float):
        self.job, self.runs = job, runs
        self.at, self.hopes = job.first_stage(coarse), _MOST_HOPES
        self.pilot_s, self.ended, self.is_placed = 0.0, "", False
        self.peak, self.lattice = math.nan, Lattice(1.0, 1.0)
        self.steady = SteadyRuns(runs, job.budget_s, self._goal_series)
        self.readings = Readings(self.steady)
        self._drift = _DRIFT * job.tolerance

    @property
    def steps(self) -> tuple[float, ...]:
        """Steps of the final runs, as multiples of the finest: one longer than safe is left out."""
        some = sorted((*STEPS, *BETWEEN)) if self.at.has_between else STEPS
        return tuple(k for k in some if k <= 2.0 or k * self.at.dt <= self.job.longest_step())

    def run(self) -> list[Estimate]:
        """Estimates of all goals, narrow enough or the best possible."""
        found: list[Estimate] = []
        best = self.at
        try:
            self._find_peak()
            self.pilot_s, self.is_placed = self.runs.cpu_s, True
            for _ in range(_MOST_ROUNDS):
                self.steady.go_on(self._keys(), self._drift, _LEAST_CYCLES, self.at.window)
                now = self._estimates()
                if self._is_told(now):
                    found, best = now, self.at
                if not self._reduce(now):
                    break
            else:
                self.ended = f"after {counted(_MOST_ROUNDS, 'round')} of longer and more runs"
        except BudgetSpent as spent:
            self.ended = f"within budget_s of {self.job.budget_s:g} s"
            if found:
                self.at = best
            # What was run since then may show a drift.
            last = self._so_far()
            found = last if self._is_told(last) else found
            if not found:
                self._refuse_budget(spent)
        return found

    def _is_told(self, found):
        """Whether there are estimates, and all of them numbers."""
        return bool(found) and all(math.isfinite(self._excess(one)) for one in found)

    def _find_peak(self):
        if self.job.follows_peak:
            search = PeakSearch(self._pilot_rms, *self.job.search_range(), self.job.span is None)
            self.peak, self.lattice, level = search.run()
            self.at = replace(self.at, level=level)

    def _pilot_rms(self, ratios):
        """RMS [m] at some ratios, as well as the pilot wants to know it."""
        keys = [SceneKey(ratio, self.at.seeds[0], 2.0 * self.at.dt) for ratio in ratios]
        self.steady.go_on(keys, _PILOT_DRIFT, _PILOT_CYCLES, _PILOT_CYCLES // 4)
        return [self.steady.parts[key].mean for key in keys]

    def _goal_series(self, key):
        """Goals by cycle of this scene's frequency: they may drift where RMS rests."""
        own = [goal for goal in self.job.goals if goal.ratios == (key.ratio,)]
        return [self.readings.series(goal, key) for goal in own]

    def _so_far(self):
        """Estimates of scenes that need not be steady; none where some have not begun."""
        keys = self._keys() if self.is_placed else []
        if not keys or min(map(self.runs.cycles, keys)) < _LEAST_CYCLES:
            return []
        self.steady.check_steady(keys, self._drift)
        return self._estimates()

    def _refuse_budget(self, spent):
        got, least = told_apart(self.job.budget_s, 1.5 * spent.needed, 2)
        raise InputError(
            f"budget_s must leave time for the pilot and one value: at least {least} s here, "
            f"got {got}"
        ) from None

    def ratios_of(self, goal: Goal) -> tuple[float, ...]:
        """Frequency ratios that a goal is made of."""
        if goal.ratios:
            return goal.ratios
        level, margin = self.at.level, self.at.margin
        around = self.lattice.around(self.peak, level)
        first, last = (round(self.lattice.position(end, level)) for end in (around[0], around[-1]))
        places = range(first - margin, last + margin + 1)
        return tuple(self.lattice.ratio(k, level) for k in places)

    def frequencies(self) -> tuple[float, ...]:
        """Frequency ratios of the final runs."""
        return tuple(sorted({ratio for goal in self.job.goals for ratio in self.ratios_of(goal)}))

    def _keys(self):
        """Scenes of the final runs, and those that tell what the spacing at a peak does."""
        steps, seeds = [k * self.at.dt for k in self.steps], self.at.seeds
        keys = [SceneKey(r, seed, dt) for dt in steps for r in self.frequencies() for seed in seeds]
        wide = dict.fromkeys(ratio for some in self._wide() for ratio in some)
        few = [SceneKey(r, seed, steps[-1]) for r in wide for seed in seeds[:_GRID_SEEDS]]
        return list(dict.fromkeys([*keys, *few]))

    def _wide(self):
        """Triples of ratios at twice the spacing around the peak, where a goal lies on it."""
        return self.lattice.wide(self.peak, self.at.level) if self.job.follows_peak else ()

    def doubts(self, goal: Goal) -> list[str]:
        """Reason to doubt a goal of the peak: it does not peak there."""
        if goal.ratios:
            return []
        ratios = sorted({*self.ratios_of(goal), *(one for some in self._wide() for one in some)})
        seeds, dt = self.at.seeds[:_GRID_SEEDS], self.steps[-1] * self.at.dt
        if not self.readings.is_at_end(goal, ratios, seeds, dt):
            return []
        return [
            "the extreme lies at an end of the frequencies around the highest RMS, so that it may "
            "go on beyond: ask for values at ratios"
        ]

    def longest(self) -> int:
        """Most cycles that a scene went."""
        return max(map(self.runs.cycles, self._keys()))

    def transient_share(self) -> float:
        """Share of all cycles of the final runs that came before the steady parts."""
        keys = self._keys()
        gone = sum(map(self.runs.cycles, keys))
        return sum(self.steady.parts[key].begin for key in keys) / max(1, gone)

    def _estimates(self):
        return [self._estimate(goal) for goal in self.job.goals]

    def _estimate(self, goal):
        ratios, seeds = self.ratios_of(goal), self.at.seeds
        levels: list[SeedValues] = [
            self.readings.seed_values(goal, ratios, seeds, k * self.at.dt) for k in self.steps
        ]
        grid = np.zeros_like(levels[0].mean)
        if not goal.ratios:
            few = seeds[:_GRID_SEEDS], self.steps[-1] * self.at.dt
            grid = self.readings.grid_error(goal, ratios, self._wide(), *few)
        rounding = rounding_of(goal, self.job.oscillator)
        asked = self.job.confidence, rounding, self.job.tolerance
        return estimate(goal, self.steps, levels, grid, *asked)

    def _reduce(self, found: list[Estimate]) -> bool:
        """Ask for more where the worst estimate needs it; False where all is done that can be."""
        worst = max(found, key=self._excess)
        excess = self._excess(worst)
        if math.isinf(excess):
            return self._widen(worst.goal)
        if excess <= 1.0 or len(worst.clusters(self.job.tolerance)) > 1:
            return False
        return self._enlarge(worst, excess)

    def _excess(self, found):
        total, allowed = size_of(found.parts.total), found.allowed(self.job.tolerance)
        if not math.isfinite(total + allowed):
            return math.inf
        return total / allowed if allowed > 0.0 else float(total > 0.0) * 1e9

    def _widen(self, goal):
        """Take in further frequencies where the peak of some seed leaves those there are."""
        level, margin = self.at.level, self.at.margin + 1
        if margin > 2 and level > 0:
            level, margin = level - 1, 1
        if goal.ratios or margin > _MOST_MARGIN:
            raise InputError(
                f"goal {goal.name!r} must be a finite number in this scene, got NaN: seeds have "
                "distant peaks, or the frequencies do not define it; ask for a goals.response_curve"
            )
        return self._go_to(level=level, margin=margin)

    def _go_to(self, **changes: Any) -> bool:
        self.at = replace(self.at, **changes)
        return True

    def _enlarge(self, found, excess):
        """Shorten the step, halve the spacing, or take more seeds or cycles."""
        source = found.largest_source()
        if source == "no order":
            return self._without_order()
        if source == "step":
            if found.step.is_seen:
                return self._go_to(dt=self.at.dt / 2.0)
            source = "chance" if _seeds_blur(found) else "cycles"
        if source == "grid":
            return self._go_to(level=self.at.level + 1)
        factor = min(2.5, max(1.25, excess * excess))
        return self._more_cycles(factor) if source == "cycles" else self._more_seeds(factor)

    def _more_cycles(self, factor):
        self._go_to(window=math.ceil(self.at.window * factor))
        if self.steady.is_full(self._keys()):
            self.ended = f"in {self.longest()} cycles"
            return False
        return True

    def _without_order(self):
        """Take in steps between, then half the step; False where there is no limit to be seen."""
        if not self.at.has_between:
            return self._go_to(has_between=True)
        if self.hopes > 0:
            self.hopes -= 1
            return self._go_to(dt=self.at.dt / 2.0)
        self.ended = f"with {len(self.steps)} steps"
        return False

    def _more_seeds(self, factor):
        """Take more seeds, and longer runs of all: seeds of a slow change differ by where it is."""
        seeds = self.at.seeds
        count = min(_MOST_SEEDS, math.ceil(len(seeds) * factor))
        if self.job.fixed is not None or count <= len(seeds):
            self.ended = f"with {len(seeds)} seeds"
            return False
        window = math.ceil(self.at.window * math.sqrt(factor))
        return self._go_to(seeds=tuple(range(1, count + 1)), window=window)


def _seeds_blur(found):
    """Whether the steps are compared less well for the seeds than for their cycles."""
    apart, sampling = (
        max(float(getattr(level, name).max()) for level in found.levels)
        for name in ("apart", "sampling")
    )
    return apart > sampling
