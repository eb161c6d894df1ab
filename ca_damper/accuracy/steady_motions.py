"""Scenes of a damper in steady motion, by level of the step and by seed."""

import math
from typing import Any

import numpy as np

from ca_damper.accuracy.readings import SteadyReadings
from ca_damper.accuracy.runs import GLUED, SceneKey, SceneRuns, SteadyRuns
from ca_damper.errors import SimulationDiverged
from ca_damper.goals import Goal
from ca_damper.report.peak_search import PeakSearch, RatioGrid
from ca_damper.runs.response import Response
from ca_damper.scenes.clock import automatic_dt
from ca_damper.spheres.options import Spheres
from taichi_dem.kit.bars.answer import largest
from taichi_dem.kit.bars.chance import LEAST_SEEDS
from taichi_dem.kit.bars.runs import BaseRuns, Question
from taichi_dem.kit.display import counted
from taichi_dem.kit.errors import InputError

# Coarsest step by the filling's own and by its bound, which is that of safe runs. Coarse runs tell
# of the error of finer ones at little cost.
_OF_DEFAULT, _OF_BOUND = 4.0, 1.4
# Share of the budget that the first level may take.
_FIRST = 0.4
# Seeds to begin with: so many particles in all, as few of them often have several steady motions.
# Fewer than LEAST_SEEDS may agree by luck where there are two motions: three do in one of four.
_FIRST_SEEDS, _PARTICLES = 8, 80
# Cycles of the steady part of a scene, at least and at most.
_LEAST_WINDOW, _MOST_WINDOW = 12, 512
# Cycles of all of it at least, of one that begins at rest, and in a steady state or near it.
_FROM_REST, _FROM_STEADY = 32, 16
# Drift that does not matter: as a share of the value in the pilot, of the tolerance in the end.
_PILOT_DRIFT, _DRIFT = 0.05, 0.2
# Range of a search by the peak of the rigid mass and by the natural frequency.
_BELOW, _ABOVE = 0.95, 1.04
# Seeds by which the frequencies at a peak are judged, and frequencies added on either side of it.
_GRID_SEEDS, _MOST_MARGIN = 3, 5
# More cycles, or seeds and cycles each, where a bar by chance is to be narrower.
_MORE = math.sqrt(2.0)
# Values that are rounding, as a share of one of their unit's size.
_ZERO = 1e-12
#: Why one seed of a filling that draws is no answer.
_ONE_SEED = (
    "the spread from seed to seed was not measured and is not in the bar: two seeds or more show it"
)


class SteadyMotions(BaseRuns):
    """Scenes of a filling at levels of the step, each run until it is steady.

    span: range of ratios in which to look for a peak, or None. fixed: seeds, or None for ours.
    """

    run, ends = "seed", "reached {} steady motions"

    def __init__(
        self,
        question: Question,
        runs: SceneRuns,
        span: tuple[float, float] | None = None,
        fixed: tuple[int, ...] | None = None,
    ):
        super().__init__()
        self.question, self.runs, self.span, self.fixed = question, runs, span, fixed
        self.filling = runs.filling
        self.averaged = self.divides = self._is_drawn()
        self.few = self.seeds = self._first_seeds()
        self.window, self.margin = _LEAST_WINDOW, 0
        self.longest = self._longest_step()
        # Level of the step of the pilot, ratio of the peak, and the frequencies around it.
        self.coarse, self.peak, self.lattice, self.fineness = 0.0, math.nan, RatioGrid(1.0, 1.0), 0
        self.steady = SteadyRuns(runs, question.budget_s, self._goal_series)
        self.readings = SteadyReadings(self.steady)
        self._known: dict[tuple, np.ndarray] = {}

    def _is_drawn(self):
        """Whether seeds make a difference."""
        filling, particles = self.filling, self.runs.particles
        if isinstance(filling, Spheres):
            # Only the places of spheres, and who has which size, are drawn.
            return particles > 0 and (filling.start is None or bool(filling.sizes))
        return particles > 0 and not isinstance(filling, GLUED)

    def _first_seeds(self):
        """Number of seeds to begin with; one of a filling that draws nothing."""
        if self.fixed is not None or not self.averaged:
            return len(self.fixed or (1,))
        several = math.ceil(_PARTICLES / self.runs.particles)
        return min(_FIRST_SEEDS, max(LEAST_SEEDS, several))

    def step(self, level: float) -> float:
        """Largest step at a level [s]."""
        return self.longest / 2.0**level

    def _longest_step(self):
        """Largest step at level 0 [s]; without grains only the cycle limits it."""
        asked = [ratio for goal in self.question.goals for ratio in goal.ratios]
        highest, filling = max([_ABOVE, *(self.span or ()), *asked]), self.filling
        longest = math.inf if isinstance(filling, GLUED) else _OF_DEFAULT * filling.default_dt
        if filling.step_bound is not None:
            longest = min(longest, _OF_BOUND * filling.step_bound[0])
        return automatic_dt(longest, highest * self.runs.oscillator.natural_frequency)

    def _least(self, level):
        """Cycles of a scene at least: at a finer level it goes on from the coarser one."""
        near = level >= self.coarse + 1 or isinstance(self.filling, GLUED)
        return _FROM_STEADY if near else _FROM_REST

    def nearby(self, level: float) -> float:
        """Level at which a smooth run is made again, with a tenth more steps."""
        return level + math.log2(1.1)

    def eventful(self, level: float) -> bool:
        """Whether seeds make a difference."""
        return self.averaged

    def is_smooth(self, goal: Goal) -> bool:
        """All goals are smooth where nothing is drawn."""
        return not self.averaged

    def rounding(self, goal: Goal) -> float:
        """Value of a goal that is zero but for rounding, by the size that its unit has here."""
        o = self.runs.oscillator
        return _ZERO * {"1": 1.0, "m": o.base_amplitude, "kg": o.mass}.get(goal.unit, 0.0)

    def release(self) -> None:
        """Nothing is held: the engine goes to the next batch."""

    def sample(self, goal: Goal, level: float, count: int) -> np.ndarray:
        """Values of so many seeds at a level, (seeds, places); none where one diverged."""
        key = goal, level, count
        if key not in self._known:
            # Two levels are needed: the first leaves room for the second.
            self.steady.share = 1.0 if self.cost else _FIRST
            try:
                self._find_peak(level)
                self._go_on(level, self.names(count))
            except SimulationDiverged as diverged:
                self.failure, self.coarse = str(diverged), level + 1
                self.runs.forget()
                return np.empty((0, 1))
            self._known[key] = goal.values(self.result(goal, level, count))
        return self._known[key]

    def result(self, goal: Goal, level: float, count: int) -> Response:
        """Response of so many seeds at a level."""
        ratios, dt = self._ratios_of(goal), self.step(level)
        return self.readings.response(ratios, self.names(count), dt)

    def names(self, count: int) -> tuple[int, ...]:
        """So many seeds, or those that are given."""
        return self.fixed or tuple(range(1, 1 + count))

    def _find_peak(self, level):
        """Find the peak where a goal lies on it, by one seed."""
        if all(goal.ratios for goal in self.question.goals) or math.isfinite(self.peak):
            return
        o, mass = self.runs.oscillator, self.runs.particles * self.filling.particle_mass
        ends = self.span or (_BELOW * o.peak(mass)[0], _ABOVE)
        search = PeakSearch(self._pilot_rms, *ends, self.span is None)
        self.peak, self.lattice, self.fineness = search.run()

    def _pilot_rms(self, ratios):
        """RMS [m] at some ratios, as well as the pilot wants to know it."""
        keys = [SceneKey(ratio, self.names(1)[0], self.step(self.coarse)) for ratio in ratios]
        least = self._least(self.coarse)
        self.steady.go_on(keys, _PILOT_DRIFT, least, least // 4)
        return [self.steady.parts[key].mean for key in keys]

    def _go_on(self, level, seeds):
        """Let the scenes of a level go on until they are steady."""
        goals, dt = self.question.goals, self.step(level)
        places = dict.fromkeys(ratio for goal in goals for ratio in self._ratios_of(goal))
        keys = [SceneKey(ratio, seed, dt) for ratio in places for seed in seeds]
        around = [ratio for goal in goals if not goal.ratios for ratio in self._around(goal)]
        at = self.step(self.coarse)
        few = [SceneKey(ratio, seed, at) for ratio in around for seed in seeds[:_GRID_SEEDS]]
        drift = _DRIFT * self.question.tolerance
        self.steady.go_on(dict.fromkeys([*keys, *few]), drift, self._least(level), self.window)
        self.seconds, self.count = self.runs.cpu_s, self.runs.runs
        self.cost[level] = self.runs.seconds({k: self.runs.cycles(k) for k in keys}) / len(seeds)

    def _goal_series(self, key):
        """Goals by cycle of this scene's frequency: they may drift where RMS rests."""
        own = [goal for goal in self.question.goals if goal.ratios == (key.ratio,)]
        return [self.readings.series(goal, key) for goal in own]

    def _ratios_of(self, goal):
        """Frequency ratios that a goal is made of."""
        if goal.ratios:
            return goal.ratios
        level, margin = self.fineness, self.margin
        around = self.lattice.around(self.peak, level)
        first, last = (round(self.lattice.position(end, level)) for end in (around[0], around[-1]))
        places = range(first - margin, last + margin + 1)
        return tuple(self.lattice.ratio(k, level) for k in places)

    def _wide(self):
        """Triples of ratios at twice the spacing around the peak."""
        return self.lattice.wide(self.peak, self.fineness)

    def _around(self, goal):
        """All ratios by which the frequencies at a peak are judged."""
        return sorted({*self._ratios_of(goal), *(ratio for some in self._wide() for ratio in some)})

    def sampling(self, goal: Goal, level: float, count: int) -> np.ndarray:
        """Half-width by what is left of the start, and by frequencies, (places,)."""
        size = np.abs(self.sample(goal, level, count).mean(axis=0))
        ratios, seeds = self._ratios_of(goal), self.names(count)
        error = self.readings.drift(ratios, seeds, self.step(level)) * size
        if not goal.ratios:
            few = seeds[:_GRID_SEEDS], self.step(self.coarse)
            error = np.hypot(error, self.readings.grid_error(goal, ratios, self._wide(), *few))
        return error

    def more(self, count: int) -> int | None:
        """Twice as many seeds, which go on for longer: those of a slow change differ by its phase.

        Of given seeds, the same that go on for longer.
        """
        more = count if self.fixed else super().more(count)
        if more is None or self.window >= _MOST_WINDOW:
            return None
        self._ask_again(window=math.ceil(self.window * (_MORE if more > count else 2.0)))
        return more

    def resolve(self, goal: Goal) -> bool:
        """Take in frequencies where a seed peaks elsewhere, or halve their spacing."""
        lost = not np.isfinite(largest(next(reversed(self._known.values()))))
        if not lost and not goal.ratios:
            return self._ask_again(fineness=self.fineness + 1)
        if not lost:
            return self.window < _MOST_WINDOW and self._ask_again(window=2 * self.window)
        margin, fineness = self.margin + 1, self.fineness
        if margin > 2 and fineness > 0:
            fineness, margin = fineness - 1, 1
        if goal.ratios or margin > _MOST_MARGIN:
            raise InputError(
                f"goal {goal.name!r} must be a finite number in this scene, got NaN: seeds have "
                "distant peaks, or the frequencies do not define it; ask for a goals.response_curve"
            )
        return self._ask_again(fineness=fineness, margin=margin)

    def state(self) -> dict[str, Any]:
        """Which scenes are run, and the values that are known of them."""
        names = "window", "margin", "fineness"
        return {**{name: getattr(self, name) for name in names}, "_known": dict(self._known)}

    def _ask_again(self, **changes: Any) -> bool:
        """Change which scenes are run, of which no value is known then."""
        vars(self).update(changes)
        self._known.clear()
        return True

    def doubts(self, goal: Goal, levels: Any, bar: Any, affords: Any) -> list[str]:
        """Reasons to doubt a goal: it does not peak there, or one seed shows no spread."""
        doubts = [_ONE_SEED] if self.averaged and self.few == 1 else []
        few = self.names(self.few)[:_GRID_SEEDS], self.step(self.coarse)
        if not goal.ratios and self.readings.is_at_end(goal, self._around(goal), *few):
            doubts.append(
                "the extreme lies at an end of the frequencies around the highest RMS, so that it "
                "may go on beyond: ask for values at ratios"
            )
        return doubts

    def in_words(self, level: float, count: int) -> str:
        """Filling, step, frequencies, seeds and cycles."""
        places = {ratio for goal in self.question.goals for ratio in self._ratios_of(goal)}
        several = "1 frequency" if len(places) == 1 else f"{len(places)} frequencies"
        step, seeds = f"{self.step(level):.3g} s", counted(count, "seed")
        cycles = f"up to {self.runs.longest()} cycles"
        return ", ".join((self.filling.label, step, several, seeds, cycles))
