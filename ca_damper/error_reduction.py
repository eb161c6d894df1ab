"""Reduction of the error of goals: which scenes go on, until the bars are narrow enough."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Optional

import numpy as np

from ca_damper.branches import clusters_of
from ca_damper.fixed_mass import Empty, RigidMass
from ca_damper.goal_estimate import Estimate, estimate, response_of, seed_values, size_of
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.peak_search import Lattice, PeakSearch
from ca_damper.scene_runs import SceneKey, SceneRuns
from ca_damper.steady_state import SteadyPart, steady_part
from taichi_dem.kit.errors import InputError
from taichi_dem.kit.progress.progress import Listener

#: Order of the step's error: contacts begin and end within a step, and so do an automaton's
#: events, which is of first order whatever integrates the motion between them.
STEP_ORDER = 1.0
#: Coarse step by fine one.
STEP_RATIO = 2.0
# First coarse step by the filling's own and by its bound, which is that of safe runs.
_OF_DEFAULT, _OF_BOUND = 1.5, 1.4
# Seeds to begin with, and the most there are.
_FIRST_SEEDS, _MOST_SEEDS = 3, 96
# Cycles that a scene goes at least in the pilot and in the end, and those of its steady part.
_PILOT_CYCLES, _LEAST_CYCLES, _LEAST_WINDOW = 40, 64, 32
_MOST_CYCLES = 40_000
# Drift that does not matter: as a share of the value in the pilot, of the tolerance in the end.
_PILOT_DRIFT, _DRIFT = 0.05, 0.2
_MOST_ROUNDS = 24
# Range of a search by the peaks of the rigid mass and of the empty container.
_BELOW, _ABOVE = 0.95, 1.04


class BudgetSpent(Exception):
    """The next runs would take more than is left. needed: what they would take in all [s]."""

    def __init__(self, needed: float):
        super().__init__(needed)
        self.needed = needed


@dataclass
class Job:
    """A checked question. span: range of ratios or None. fixed: seeds, or None for ours."""

    filling: Any
    particles: int
    oscillator: Oscillator
    span: Optional[tuple[float, float]]
    fixed: Optional[tuple[int, ...]]
    goals: tuple[Goal, ...] = ()
    tolerance: float = 0.01
    confidence: float = 0.95
    budget_s: float = math.inf
    listener: Optional[Listener] = field(default=None, repr=False)

    def first_step(self) -> float:
        """Coarse step to begin with [s]."""
        step, bound = _OF_DEFAULT * self.filling.default_dt, self.filling.step_bound
        return step if bound is None else min(step, _OF_BOUND * bound[0])

    def first_seeds(self) -> tuple[int, ...]:
        """Seeds to begin with; one of a filling that draws nothing."""
        if self.fixed is not None:
            return self.fixed
        certain = self.particles == 0 or isinstance(self.filling, (Empty, RigidMass))
        return tuple(range(1, 2 if certain else _FIRST_SEEDS + 1))

    def search_range(self) -> tuple[float, float]:
        """Range in which to look for a peak first."""
        if self.span is not None:
            return self.span
        o = self.oscillator
        return _BELOW * o.peak(self.particles * self.filling.particle_mass)[0], _ABOVE


class Reduction:
    """Runs of a job with coarse steps of ``2 dt`` and fine ones of ``dt`` [s].

    seeds: that are run. pilot_s: CPU seconds of what came before the final runs.
    """

    def __init__(self, job: Job, runs: SceneRuns, coarse: float):
        self.job, self.runs, self.dt = job, runs, coarse / STEP_RATIO
        self.seeds, self.pilot_s = job.first_seeds(), 0.0
        self.peak, self.lattice = math.nan, Lattice(1.0, 1.0)
        self.window, self.margin, self.ended = _LEAST_WINDOW, 0, ""
        self.steady: dict[SceneKey, SteadyPart] = {}

    @property
    def coarse(self) -> float:
        """Coarse step [s]."""
        return STEP_RATIO * self.dt

    def run(self) -> list[Estimate]:
        """Estimates of all goals, good enough or the best that could be had."""
        found: list[Estimate] = []
        try:
            self._search()
            self.pilot_s = self.runs.cpu_s
            for _ in range(_MOST_ROUNDS):
                self._make_steady()
                found = self._estimates()
                if not self._reduce(found):
                    break
            else:
                self.ended = f"after {_MOST_ROUNDS} rounds of longer and more runs"
        except BudgetSpent as spent:
            self.ended = f"within budget_s of {self.job.budget_s:g} s"
            found = found or self._first(spent)
        return found

    def _search(self):
        """Find the peak, where a goal lies on it, with the first seed and the coarse step."""
        if all(goal.ratios for goal in self.job.goals):
            return
        search = PeakSearch(self._pilot_rms, *self.job.search_range(), self.job.span is None)
        self.peak, self.lattice = search.run()

    def _pilot_rms(self, ratios):
        """RMS [m] at some ratios, as well as the pilot wants to know it."""
        keys = [SceneKey(ratio, self.seeds[0], self.coarse) for ratio in ratios]
        self._go_steady(keys, _PILOT_DRIFT, _PILOT_CYCLES, _PILOT_CYCLES // 4)
        return [self.steady[key].mean for key in keys]

    def _make_steady(self):
        drift = _DRIFT * self.job.tolerance
        self._go_steady(self._keys(), drift, _LEAST_CYCLES, self.window)

    def _go_steady(self, keys, drift, least, window):
        """Let scenes go on until each is steady, within a drift, for a window of cycles."""
        while True:
            more = {key: self._missing(key, drift, least, window) for key in keys}
            more = {key: count for key, count in more.items() if count > 0}
            if not more:
                return
            self._check_budget(more)
            self.runs.go_on(more)

    def _missing(self, key, drift, least, window):
        """Cycles that a scene has to go on by before it can be judged, or is good enough."""
        gone = self.runs.cycles(key)
        if gone < least:
            return least - gone
        part = self.steady[key] = _steady(self.runs.series(key), drift)
        if gone >= _MOST_CYCLES:
            return 0
        if not part.is_steady:
            return min(_rounded(part.more), _MOST_CYCLES - gone)
        return min(_rounded(1.25 * (window - (gone - part.begin))), _MOST_CYCLES - gone)

    def _check_budget(self, more: Mapping[SceneKey, int]) -> None:
        needed = self.runs.cpu_s + self.runs.seconds(more)
        if needed > self.job.budget_s:
            raise BudgetSpent(needed)

    def _first(self, spent):
        """Estimates of scenes that are not steady; InputError where some have not begun."""
        keys = self._keys() if self.pilot_s else []
        if not keys or min(map(self.runs.cycles, keys)) < _LEAST_CYCLES:
            raise InputError(
                "budget_s must leave time for the pilot and one value: at least "
                f"{1.5 * spent.needed:.2g} s here, got {self.job.budget_s:g}"
            ) from None
        for key in keys:
            self.steady[key] = _steady(self.runs.series(key), _DRIFT * self.job.tolerance)
        return self._estimates()

    def ratios_of(self, goal: Goal) -> tuple[float, ...]:
        """Frequency ratios that a goal is made of."""
        if goal.ratios:
            return goal.ratios
        near = self.lattice.around(self.peak)
        level = self.lattice.level
        first, last = (round(self.lattice.place(end, level)) for end in (near[0], near[-1]))
        places = range(first - self.margin, last + self.margin + 1)
        return tuple(self.lattice.ratio(k, level) for k in places)

    def frequencies(self) -> tuple[float, ...]:
        """Frequency ratios of the final runs."""
        return tuple(sorted({ratio for goal in self.job.goals for ratio in self.ratios_of(goal)}))

    def _keys(self):
        """Scenes of the final runs, and those that tell what the spacing at a peak does."""
        steps = self.dt, self.coarse
        ratios = self.frequencies()
        keys = [SceneKey(r, seed, dt) for dt in steps for r in ratios for seed in self.seeds]
        return list(dict.fromkeys([*keys, *self._wide()]))

    def _wide(self):
        """Scenes at twice the spacing around the peak, of the first seed at the coarse step."""
        if all(goal.ratios for goal in self.job.goals):
            return []
        wide = self.lattice.wide(self.peak)
        return [SceneKey(ratio, self.seeds[0], self.coarse) for ratio in wide]

    def begins(self) -> dict[SceneKey, int]:
        """Cycle at which the steady part of each scene begins."""
        return {key: part.begin for key, part in self.steady.items()}

    def longest(self) -> int:
        """Most cycles that a scene went."""
        return max(map(self.runs.cycles, self._keys()))

    def transient_share(self) -> float:
        """Share of all cycles of the final runs that came before the steady parts."""
        keys = self._keys()
        gone = sum(map(self.runs.cycles, keys))
        return sum(self.steady[key].begin for key in keys) / max(1, gone)

    def _estimates(self):
        """Estimates of all goals from what has been run."""
        return [self._estimate(goal) for goal in self.job.goals]

    def _estimate(self, goal):
        ratios = self.ratios_of(goal)
        fine, coarse = (
            seed_values(goal, self.runs, ratios, self.seeds, dt, self.steady)
            for dt in (self.dt, self.coarse)
        )
        grid = np.zeros_like(fine.mean) if goal.ratios else self._grid_error(goal, ratios)
        return estimate(goal, fine, coarse, grid, STEP_RATIO, STEP_ORDER, self.job.confidence)

    def _grid_error(self, goal, ratios):
        """Half-width by the spacing at the peak: a quarter of what twice the spacing changes."""
        first, wide = self.seeds[:1], [key.ratio for key in self._wide()]
        given = self.runs, first, self.coarse, self.begins()
        near, far = (
            goal.values(response_of(given[0], some, *given[1:]))[0] for some in (ratios, wide)
        )
        return np.abs(far - near) / 4.0

    def shortfall(self, found: Estimate) -> str:
        """Why the bar of an estimate is wider than asked, and what would help; "" if it is not."""
        size, total = size_of(found.value), size_of(found.parts.total)
        if total <= self.job.tolerance * size:
            return ""
        reached = f"{100.0 * total / size:.2g} %" if size > 0.0 else "wider than the value"
        source, advice = _ADVICE[_largest_source(found)]
        return (
            f"{100.0 * self.job.tolerance:g} % was not reached {self.ended}: the bar is {reached}, "
            f"most of it {source}; {advice}"
        )

    def _reduce(self, found: list[Estimate]) -> bool:
        """Ask for more where the worst estimate needs it; False where all is done that can be."""
        worst = max(found, key=self._excess)
        excess = self._excess(worst)
        if math.isinf(excess):
            return self._widen(worst.goal)
        if excess <= 1.0 or self._is_branched(worst):
            return False
        return self._enlarge(worst, _largest_source(worst), excess)

    def _excess(self, found):
        """Bar by the bar that is allowed; infinite for no number."""
        size, total = size_of(found.value), size_of(found.parts.total)
        if not math.isfinite(size + total):
            return math.inf
        return total / (self.job.tolerance * size) if size > 0.0 else float(total > 0.0) * 1e9

    def _widen(self, goal):
        """Add a frequency on either side of a peak that leaves them for some seed."""
        self.margin += 1
        if goal.ratios or self.margin > 3:
            raise InputError(
                f"goal {goal.name!r} must be a finite number in this scene, got NaN: the "
                "frequencies it is asked at may not define it"
            )
        return True

    def _is_branched(self, found):
        """Whether the seeds are known to come to several steady motions."""
        if found.value.size != 1:
            return False
        values, error = found.fine.values[:, 0], math.sqrt(float(found.fine.variance[0]))
        least = 0.5 * self.job.tolerance * size_of(found.value)
        return len(clusters_of(values, error, least)) > 1

    def _enlarge(self, found, source, excess):
        """Shorten the step, halve the spacing, or take more seeds or cycles."""
        if source == "step":
            if found.step_is_seen:
                self.dt /= STEP_RATIO
                return True
            source = "chance" if found.fine.apart.max() > 0.0 else "cycles"
        factor = min(2.5, max(1.25, excess**2))
        if source == "grid":
            self.lattice.level += 1
        elif source == "cycles":
            self.window = math.ceil(self.window * factor)
        else:
            return self._more_seeds(factor)
        return True

    def _more_seeds(self, factor):
        count = min(_MOST_SEEDS, math.ceil(len(self.seeds) * factor))
        if self.job.fixed is not None or count <= len(self.seeds):
            self.ended = f"with {len(self.seeds)} seeds"
            return False
        self.seeds = tuple(range(1, count + 1))
        return True


_ADVICE = {
    "step": ("of the time step", "a larger budget_s shortens it"),
    "chance": ("from seed to seed", "more seeds narrow it"),
    "cycles": ("of the mean over cycles", "a larger budget_s lengthens the runs"),
    "grid": ("of the frequencies around the peak", "a larger budget_s takes more of them"),
}


def _largest_source(found: Estimate) -> str:
    """Where most of a bar comes from, a key of _ADVICE."""
    cycles = np.sqrt(np.maximum(found.parts.sampling**2 - found.grid**2, 0.0))
    sources = {
        "step": found.parts.step,
        "chance": found.parts.chance,
        "cycles": cycles,
        "grid": found.grid,
    }
    return max(sources, key=lambda name: float(np.max(sources[name])))


def _steady(series: np.ndarray, drift: float) -> SteadyPart:
    """Steady part of the RMS of a scene, where its amplitude is steady too; series (2, cycles)."""
    rms, amplitude = (steady_part(row, drift) for row in series)
    size = abs(amplitude.mean)
    away = amplitude.drift / size * abs(rms.mean) if amplitude.drift > 0.0 else 0.0
    return replace(
        rms,
        is_steady=rms.is_steady and amplitude.is_steady,
        begin=max(rms.begin, amplitude.begin),
        drift=max(rms.drift, away),
        more=max(rms.more, amplitude.more),
    )


def _rounded(cycles: float) -> int:
    """A number of cycles in eighths of a run, at least 0."""
    return max(0, 8 * math.ceil(cycles / 8.0))
