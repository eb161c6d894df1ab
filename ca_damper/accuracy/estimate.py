"""Estimate of a goal from runs: its value and the sources of its error."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ca_damper.accuracy.runs import SceneKey, SteadyRuns
from ca_damper.goals import Goal
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import MEASURE_UNITS
from ca_damper.report.steady_state import BATCHES, correlation_factor
from ca_damper.runs.response import Response
from taichi_dem.kit.bars.answer import ErrorParts, Values
from taichi_dem.kit.bars.chance import clusters_of, t_quantile
from taichi_dem.kit.bars.step import SUPPORTED, StepPart, step_part

#: Order of the step's error: contacts begin and end within a step, and so do an automaton's
#: events, which is of first order whatever integrates the motion between them.
STEP_ORDER = 1.0
#: Source of most of a bar, and what narrows it.
SOURCES = {
    "step": ("of the time step", "a larger budget_s shortens it"),
    "no order": (
        "of the time step, with which the value changes in no order",
        "no step of this model narrows it",
    ),
    "chance": ("from seed to seed", "more seeds narrow it"),
    "cycles": ("of the mean over cycles", "a larger budget_s lengthens the runs"),
    "grid": ("of the frequencies around the peak", "a larger budget_s takes more of them"),
}
# Values that are rounding, as a share of one of their unit's size.
_ZERO = 1e-12


@dataclass(frozen=True, eq=False)
class SeedValues:
    """A goal's values at one step, (seeds, places)."""

    values: np.ndarray
    variance: np.ndarray
    freedom: int
    drift: np.ndarray

    @property
    def mean(self) -> np.ndarray:
        """Mean over the seeds, (places,)."""
        return self.values.mean(axis=0)

    @property
    def sampling(self) -> np.ndarray:
        """Standard error of the mean by sampling alone, (places,)."""
        return np.sqrt(self.variance / len(self.values))

    @property
    def apart(self) -> np.ndarray:
        """Standard error of the mean from seed to seed, (places,); 0 for one seed."""
        # The spread of seeds includes the sampling of their cycles, which is not counted again.
        count = len(self.values)
        if count < 2:
            return np.zeros_like(self.variance)
        return self.values.std(axis=0, ddof=1) / math.sqrt(count)

    def bars(self, confidence: float) -> tuple[np.ndarray, np.ndarray]:
        """Half-widths (sampling, chance), (places,) each."""
        sampling = t_quantile(confidence, self.freedom) * self.sampling
        total = self.apart
        if len(self.values) > 1:
            total = t_quantile(confidence, len(self.values) - 1) * total
        chance = np.sqrt(np.maximum(total**2 - sampling**2, 0.0))
        return np.hypot(sampling, self.drift), chance


@dataclass(frozen=True, eq=False)
class Estimate:
    """A goal's value (places,) with its error parts; levels: the values at each step, fine first.

    grid: half-width by the frequencies between which a peak lies. rounding: error of the machine of
    a value that is truly zero. Both are part of the sampling.
    """

    goal: Goal
    parts: ErrorParts
    levels: tuple[SeedValues, ...]
    step: StepPart
    grid: np.ndarray
    rounding: float = 0.0

    @property
    def value(self) -> np.ndarray:
        """Value of the goal, (places,)."""
        return self.step.value

    @property
    def fine(self) -> SeedValues:
        """Values at the finest step."""
        return self.levels[0]

    def allowed(self, tolerance: float) -> float:
        """Largest half-width that is narrow enough, at least that of rounding."""
        return float(np.maximum(tolerance * size_of(self.value), 2.0 * self.rounding))

    def clusters(self, tolerance: float) -> list[np.ndarray]:
        """Numbers of the seeds in each steady motion, of a goal with one value."""
        if self.value.size != 1:
            return []
        error = math.sqrt(float(self.fine.variance[0]))
        return clusters_of(self.fine.values[:, 0], error, 0.5 * self.allowed(tolerance))

    def largest_source(self) -> str:
        """Where most of the bar comes from, a key of SOURCES."""
        sources = {
            "step": self.parts.step,
            "chance": self.parts.chance,
            "cycles": np.sqrt(np.maximum(self.parts.sampling**2 - self.grid**2, 0.0)),
            "grid": self.grid,
        }
        name = max(sources, key=lambda name: float(np.max(sources[name])))
        return "no order" if name == "step" and not self.step.is_regular else name

    def shortfall(self, tolerance: float, ended: str) -> str:
        """Why the bar is wider than asked, and what would help; "" if it is not."""
        size, total = size_of(self.value), size_of(self.parts.total)
        if total <= self.allowed(tolerance):
            return ""
        reached = f"{100.0 * total / size:.2g} %" if size > 0.0 else "wider than the value"
        source, advice = SOURCES[self.largest_source()]
        return (
            f"{100.0 * tolerance:g} % was not reached {ended}: the bar is {reached}, most of it "
            f"{source}; {advice}"
        )


def estimate(
    goal: Goal,
    steps: Sequence[float],
    levels: Sequence[SeedValues],
    grid: np.ndarray,
    confidence: float,
    rounding: float = 0.0,
    tolerance: float = 0.0,
) -> Estimate:
    """Estimate of a goal from its values at steps, as multiples of the finest and from it on."""
    means = np.array([one.mean for one in levels])
    errors = np.array([np.maximum(one.sampling, one.apart) for one in levels])
    step = step_part(steps, means, errors, STEP_ORDER, confidence)
    sampling, chance = levels[0].bars(confidence)
    # A value that is zero is off by what its runs show of rounding, which may be nothing.
    shown = np.minimum(rounding, np.abs(means).max(axis=0))
    sampling = np.hypot(np.hypot(sampling, grid), shown)
    shift = np.where(step.regular, _shift(step.error, np.hypot(sampling, chance), confidence), 0.0)
    if len(steps) < 3:
        shift = np.maximum(shift, SUPPORTED * tolerance * size_of(step.value))
    parts = ErrorParts(step=np.maximum(step.error, shift), chance=chance, sampling=sampling)
    return Estimate(goal, parts, tuple(levels), step, grid, rounding)


def _shift(error, blur, confidence):
    """Half-width of an error that is of one sign, beside one of chance: their squares then add."""
    # The bar must hold the bias plus chance on one side, which is more than the root of their
    # squares.
    one_sided = max(0.5, 2.0 * confidence - 1.0)
    share = t_quantile(one_sided, math.inf) / t_quantile(confidence, math.inf)
    return np.sqrt(np.maximum((error + min(1.0, share) * blur) ** 2 - blur**2, 0.0))


def rounding_of(goal: Goal, oscillator: Oscillator) -> float:
    """Value of a goal that is zero but for rounding, by the size that its unit has in a scene."""
    sizes = {"1": 1.0, "m": oscillator.base_amplitude, "kg": oscillator.mass}
    return _ZERO * sizes.get(goal.unit, 0.0)


def size_of(value: Values) -> float:
    """Largest magnitude of a value; NaN where one is no number."""
    return float(np.abs(value).max()) if np.isfinite(value).all() else math.nan


class Readings:
    """Goals of the steady parts of scenes."""

    def __init__(self, steady: SteadyRuns):
        self.steady, self.runs = steady, steady.runs

    def seed_values(
        self, goal: Goal, ratios: Sequence[float], seeds: Sequence[int], dt: float
    ) -> SeedValues:
        """Values of a goal at a step [s], with the errors of their cycles by leaving parts out."""
        # A goal that is not linear is biased by 1 / cycles (a peak stands where chance lifts it):
        # leaving parts out measures the bias, which is subtracted.
        values = goal.values(self.response(ratios, seeds, dt))
        without = goal.values(self.response(ratios, seeds, dt, BATCHES))
        left = without.reshape(len(seeds), BATCHES, values.shape[1])
        apart = left - left.mean(axis=1, keepdims=True)
        variance = ((BATCHES - 1) / BATCHES * (apart**2).sum(axis=1)).mean(axis=0)
        values = values - (BATCHES - 1) * (left.mean(axis=1) - values)
        begins = self.steady.begins()
        keys = [SceneKey(ratio, seed, dt) for ratio in ratios for seed in seeds]
        more = np.mean([_correlated(self.runs.by_cycle(key)["rms"][begins[key] :]) for key in keys])
        drift = max(_share(self.steady.parts[key]) for key in keys) * np.abs(values.mean(axis=0))
        return SeedValues(values, more * variance, len(seeds) * (BATCHES - 1), drift)

    def grid_error(
        self,
        goal: Goal,
        ratios: Sequence[float],
        wide: Sequence[Sequence[float]],
        seeds: Sequence[int],
        dt: float,
    ) -> np.ndarray:
        """Half-width by the frequencies at a peak, (places,)."""
        # The largest change of the goal with other frequencies: those of ``wide``, twice the
        # spacing, or without one near the peak. A tenth if the peak is lost at twice the spacing.
        everywhere = sorted({*ratios, *(ratio for some in wide for ratio in some)})
        inside = [ratio for ratio in ratios if ratio not in (everywhere[0], everywhere[-1])]
        without = [[one for one in everywhere if one != ratio] for ratio in inside]
        own, *others = (
            goal.values(self.response(some, seeds, dt)).mean(axis=0)
            for some in (ratios, *wide, *without)
        )
        change = np.abs(np.array(others) - own)
        known = np.where(np.isnan(change), -1.0, change).max(axis=0)
        return np.where(known < 0.0, 0.1 * np.abs(own), known)

    def is_at_end(
        self, goal: Goal, ratios: Sequence[float], seeds: Sequence[int], dt: float
    ) -> bool:
        """Whether most seeds have an extreme at the first or last of some ratios."""
        # An extreme at an end changes without it, and nothing tells how far it goes beyond.
        whole, *without = (
            goal.values(self.response(some, seeds, dt))
            for some in (ratios, ratios[1:], ratios[:-1])
        )
        changed = np.any([np.abs(one - whole) > 0.0 for one in without], axis=0)
        return bool((changed.mean(axis=0) > 0.5).any())

    def series(self, goal: Goal, key: SceneKey) -> np.ndarray:
        """A goal by cycle, of one that is made of the frequency of this scene alone, (cycles,)."""
        values = {name: value[None, None] for name, value in self.runs.by_cycle(key).items()}
        named = tuple(range(self.runs.cycles(key)))
        return goal.values(self._made((key.ratio,), named, key.dt, values))[:, 0]

    def response(
        self, ratios: Sequence[float], seeds: Sequence[int], dt: float, leave_out: int = 0
    ) -> Response:
        """Response of the steady parts of scenes at a step [s]."""
        begins, rows = self.steady.begins(), []
        for ratio in ratios:
            keys = [SceneKey(ratio, seed, dt) for seed in seeds]
            rows.append([self.runs.measures(key, begins[key], leave_out) for key in keys])
        values = {
            name: np.stack([np.concatenate([one[name] for one in row]) for row in rows])[None]
            for name in MEASURE_UNITS
        }
        named = tuple(range(len(seeds) * leave_out)) if leave_out else tuple(seeds)
        return self._made(ratios, named, dt, values)

    def _made(self, ratios, seeds, dt, values):
        """Response of measures by name, (1, ratios, seeds) each."""
        runs, axis = self.runs, np.array(ratios)
        steps = np.array([runs.steps_per_cycle(ratio, dt) for ratio in ratios])
        places = (runs.particles,), axis, seeds
        return Response(runs.filling.label, runs.oscillator, *places, steps, **values)


def _correlated(series):
    return correlation_factor(series, BATCHES, len(series) // BATCHES)


def _share(part):
    """Drift of a scene as a share of its mean; all of it where no limit can be seen."""
    size = abs(part.mean)
    return min(1.0, part.drift / size) if part.drift > 0.0 and size > 0.0 else 0.0
