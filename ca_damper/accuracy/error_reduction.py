"""Reduction of the error of goals: which scenes go on, until the bars are narrow enough."""

import math

import numpy as np

from ca_damper.accuracy.error_sources import largest_source
from ca_damper.accuracy.goal_estimate import (
    Estimate,
    estimate,
    grid_error,
    rounding_of,
    seed_values,
    series_of,
    size_of,
)
from ca_damper.accuracy.job import Job
from ca_damper.accuracy.peak_search import Lattice, PeakSearch
from ca_damper.accuracy.scene_runs import SceneKey, SceneRuns
from ca_damper.accuracy.steady_runs import BudgetSpent, SteadyRuns
from ca_damper.goals import Goal
from taichi_dem.kit.bars.chance import clusters_of
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.validation import told_apart

#: Order of the step's error: contacts begin and end within a step, and so do an automaton's
#: events, which is of first order whatever integrates the motion between them.
STEP_ORDER = 1.0
#: Steps by the finest: these show an order, and with those between the spread where there is none.
STEPS, BETWEEN = (1.0, 2.0, 4.0), (math.sqrt(2.0), 2.0 * math.sqrt(2.0))
# Halvings of a step without an order: it may only have been too coarse.
_MOST_HOPES = 1
# Most seeds there are.
_MOST_SEEDS = 96
# Cycles that a scene goes at least in the pilot and in the end, and those of its steady part.
_PILOT_CYCLES, _LEAST_CYCLES, _LEAST_WINDOW = 40, 64, 32
# Drift that does not matter: as a share of the value in the pilot, of the tolerance in the end.
_PILOT_DRIFT, _DRIFT = 0.05, 0.2
_MOST_ROUNDS = 24
# Seeds by which the frequencies at a peak are judged.
_GRID_SEEDS = 3
# Frequencies that are added on either side of a peak.
_MOST_MARGIN = 5


class Reduction:
    """Runs of a job with steps of ``dt`` [s] and of 2 and 4 times as much.

    seeds: that are run. pilot_s: CPU seconds of what came before the final runs.
    """

    def __init__(self, job: Job, runs: SceneRuns, coarse: float):
        self.job, self.runs, self.dt = job, runs, coarse / 2.0
        self.has_between, self.hopes = False, _MOST_HOPES
        self.seeds, self.pilot_s = job.first_seeds(), 0.0
        self.peak, self.lattice = math.nan, Lattice(1.0, 1.0)
        self.window, self.margin, self.ended = _LEAST_WINDOW, 0, ""
        if job.plan is not None:
            self.window, self.margin = job.plan.window, job.plan.margin
            self.has_between = job.plan.has_between
        self.steady, self.is_placed = SteadyRuns(runs, job.budget_s, self._goal_series), False

    @property
    def coarse(self) -> float:
        """Step of the pilot [s]."""
        return 2.0 * self.dt

    @property
    def steps(self) -> tuple[float, ...]:
        """Steps of the final runs, as multiples of the finest: one longer than safe is left out."""
        some = sorted((*STEPS, *BETWEEN)) if self.has_between else STEPS
        return tuple(k for k in some if k <= 2.0 or k * self.dt <= self.job.longest_step())

    def run(self) -> list[Estimate]:
        """Estimates of all goals, good enough or the best that could be had."""
        found: list[Estimate] = []
        try:
            self._search()
            self.pilot_s, self.is_placed = self.runs.cpu_s, True
            for _ in range(_MOST_ROUNDS):
                self._make_steady()
                now = self._estimates()
                if self._is_told(now):
                    found, state = now, self._state()
                if not self._reduce(now):
                    break
            else:
                self.ended = f"after {counted(_MOST_ROUNDS, 'round')} of longer and more runs"
        except BudgetSpent as spent:
            self.ended = f"within budget_s of {self.job.budget_s:g} s"
            if found:
                self._restore(state)
            # What was run since then may show a drift.
            last = self._so_far()
            found = last if self._is_told(last) else found
            if not found:
                self._refuse_budget(spent)
        return found

    def _is_told(self, found):
        """Whether there are estimates, and all of them numbers."""
        return bool(found) and all(math.isfinite(self._excess(one)) for one in found)

    def _state(self):
        """Which runs make the present estimates."""
        return self.dt, self.has_between, self.seeds, self.lattice.level, self.margin

    def _restore(self, state):
        self.dt, self.has_between, self.seeds, self.lattice.level, self.margin = state

    def _search(self):
        """Find the peak, where a goal lies on it, with the first seed and the coarse step."""
        if all(goal.ratios for goal in self.job.goals):
            return
        search = PeakSearch(self._pilot_rms, *self.job.search_range(), self.job.span is None)
        self.peak, self.lattice = search.run()

    def _pilot_rms(self, ratios):
        """RMS [m] at some ratios, as well as the pilot wants to know it."""
        keys = [SceneKey(ratio, self.seeds[0], self.coarse) for ratio in ratios]
        self.steady.go_on(keys, _PILOT_DRIFT, _PILOT_CYCLES, _PILOT_CYCLES // 4)
        return [self.steady.parts[key].mean for key in keys]

    def _goal_series(self, key):
        """Goals by cycle of this scene's frequency: they may drift where RMS rests."""
        own = [goal for goal in self.job.goals if goal.ratios == (key.ratio,)]
        return [series_of(goal, self.runs, key) for goal in own]

    def _make_steady(self):
        drift = _DRIFT * self.job.tolerance
        self.steady.go_on(self._keys(), drift, _LEAST_CYCLES, self.window)

    def _so_far(self):
        """Estimates of scenes that need not be steady; none where some have not begun."""
        keys = self._keys() if self.is_placed else []
        if not keys or min(map(self.runs.cycles, keys)) < _LEAST_CYCLES:
            return []
        self.steady.check_steady(keys, _DRIFT * self.job.tolerance)
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
        around = self.lattice.around(self.peak)
        level = self.lattice.level
        first, last = (round(self.lattice.position(end, level)) for end in (around[0], around[-1]))
        places = range(first - self.margin, last + self.margin + 1)
        return tuple(self.lattice.ratio(k, level) for k in places)

    def frequencies(self) -> tuple[float, ...]:
        """Frequency ratios of the final runs."""
        return tuple(sorted({ratio for goal in self.job.goals for ratio in self.ratios_of(goal)}))

    def _keys(self):
        """Scenes of the final runs, and those that tell what the spacing at a peak does."""
        steps, ratios = [k * self.dt for k in self.steps], self.frequencies()
        keys = [SceneKey(r, seed, dt) for dt in steps for r in ratios for seed in self.seeds]
        return list(dict.fromkeys([*keys, *self._wide_keys()]))

    def _wide(self):
        """Triples of ratios at twice the spacing around the peak, where a goal lies on it."""
        if all(goal.ratios for goal in self.job.goals):
            return []
        return self.lattice.wide(self.peak)

    def _wide_keys(self):
        """Scenes of the wide triples, of few seeds at the coarsest step."""
        ratios, dt = dict.fromkeys(r for some in self._wide() for r in some), self._coarsest
        return [SceneKey(ratio, seed, dt) for ratio in ratios for seed in self._few_seeds]

    @property
    def _coarsest(self):
        return self.steps[-1] * self.dt

    @property
    def _few_seeds(self):
        """Seeds that tell what the frequencies at a peak do."""
        return self.seeds[:_GRID_SEEDS]

    def longest(self) -> int:
        """Most cycles that a scene went."""
        return max(map(self.runs.cycles, self._keys()))

    def transient_share(self) -> float:
        """Share of all cycles of the final runs that came before the steady parts."""
        keys = self._keys()
        gone = sum(map(self.runs.cycles, keys))
        return sum(self.steady.parts[key].begin for key in keys) / max(1, gone)

    def _estimates(self):
        """Estimates of all goals from what has been run."""
        return [self._estimate(goal) for goal in self.job.goals]

    def _estimate(self, goal):
        ratios = self.ratios_of(goal)
        levels = [
            seed_values(goal, self.runs, ratios, self.seeds, k * self.dt, self.steady)
            for k in self.steps
        ]
        grid = np.zeros_like(levels[0].mean)
        if not goal.ratios:
            few = self._few_seeds, self._coarsest, self.steady.begins()
            grid = grid_error(goal, self.runs, ratios, self._wide(), *few)
        known = STEP_ORDER, self.job.confidence, rounding_of(goal, self.job.oscillator)
        return estimate(goal, self.steps, levels, grid, *known)

    def _reduce(self, found: list[Estimate]) -> bool:
        """Ask for more where the worst estimate needs it; False where all is done that can be."""
        worst = max(found, key=self._excess)
        excess = self._excess(worst)
        if math.isinf(excess):
            return self._widen(worst.goal)
        if excess <= 1.0 or self._is_branched(worst):
            return False
        return self._enlarge(worst, largest_source(worst), excess)

    def _excess(self, found):
        """Bar by the bar that is allowed; infinite for no number."""
        total, allowed = size_of(found.parts.total), found.allowed(self.job.tolerance)
        if not math.isfinite(total + allowed):
            return math.inf
        return total / allowed if allowed > 0.0 else float(total > 0.0) * 1e9

    def _widen(self, goal):
        """Take in further frequencies where the peak of some seed leaves those there are."""
        self.margin += 1
        if self.margin > 2 and self.lattice.level > 0:
            self.lattice.level, self.margin = self.lattice.level - 1, 1
        if goal.ratios or self.margin > _MOST_MARGIN:
            raise InputError(
                f"goal {goal.name!r} must be a finite number in this scene, got NaN: seeds peak "
                "far apart, or the frequencies do not define it; ask for a goals.response_curve"
            )
        return True

    def _is_branched(self, found):
        """Whether the seeds are known to come to several steady motions."""
        if found.value.size != 1:
            return False
        values, error = found.fine.values[:, 0], math.sqrt(float(found.fine.variance[0]))
        least = 0.5 * found.allowed(self.job.tolerance)
        return len(clusters_of(values, error, least)) > 1

    def _enlarge(self, found, source, excess):
        """Shorten the step, halve the spacing, or take more seeds or cycles."""
        if source == "step":
            if not found.step.is_regular:
                return self._without_order()
            if found.step.is_seen:
                self.dt /= 2.0
                return True
            source = "chance" if _seeds_blur(found) else "cycles"
        factor = min(2.5, max(1.25, excess * excess))
        if source == "grid":
            self.lattice.level += 1
        elif source == "cycles":
            return self._more_cycles(factor)
        else:
            return self._more_seeds(factor)
        return True

    def _more_cycles(self, factor):
        self.window = math.ceil(self.window * factor)
        if self.steady.is_full(self._keys()):
            self.ended = f"in {self.longest()} cycles"
            return False
        return True

    def _without_order(self):
        """Take in steps between, then half the step; False where there is no limit to be seen."""
        if not self.has_between:
            self.has_between = True
        elif self.hopes > 0:
            self.dt, self.hopes = self.dt / 2.0, self.hopes - 1
        else:
            self.ended = f"with {len(self.steps)} steps"
            return False
        return True

    def _more_seeds(self, factor):
        """Take more seeds, and longer runs of all: seeds of a slow change differ by where it is."""
        count = min(_MOST_SEEDS, math.ceil(len(self.seeds) * factor))
        if self.job.fixed is not None or count <= len(self.seeds):
            self.ended = f"with {len(self.seeds)} seeds"
            return False
        self.seeds = tuple(range(1, count + 1))
        self.window = math.ceil(self.window * math.sqrt(factor))
        return True


def _seeds_blur(found):
    """Whether the steps are compared less well for the seeds than for their cycles."""
    apart, sampling = (
        max(float(getattr(level, name).max()) for level in found.levels)
        for name in ("apart", "sampling")
    )
    return apart > sampling
