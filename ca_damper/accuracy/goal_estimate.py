"""What is known of a goal from runs: its value, and where the error comes from."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ca_damper.accuracy.scene_runs import SceneKey, SceneRuns
from ca_damper.goals import Goal
from ca_damper.response import UNITS, Response
from ca_damper.steady_state import BATCHES, SteadyPart, correlation_factor
from taichi_dem.kit.accuracy.answer import ErrorParts, Values
from taichi_dem.kit.accuracy.student import f_outside, t_quantile
from taichi_dem.kit.display import by_fields

#: Error of the finest step by Richardson: times this.
SAFETY = 1.25
# Seeds are said to differ where chance would make their variance so large in this share of cases.
_SEEDS_ALIKE = 0.2
# Differences that are rounding, as a share of the value.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class SeedValues:
    """A goal's values at one step: values (seeds, places).

    variance: of a seed's value by the sampling of its cycles, (places,), with freedom degrees of
    freedom. drift: half-width by transients that are not over, (places,).
    """

    values: np.ndarray
    variance: np.ndarray
    freedom: int
    drift: np.ndarray

    def __repr__(self) -> str:
        return by_fields(self)

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
        """Standard error of the mean from seed to seed where seeds differ, 0 elsewhere."""
        count = len(self.values)
        if count < 2:
            return np.zeros_like(self.variance)
        between = self.values.var(axis=0, ddof=1)
        rounding = (_ROUNDING * np.abs(self.mean)) ** 2
        differ = [
            b > r and (w == 0.0 or f_outside(b / w, count - 1, self.freedom) < _SEEDS_ALIKE)
            for b, w, r in zip(between, self.variance, rounding)
        ]
        return np.where(differ, np.sqrt(between / count), 0.0)

    def bars(self, confidence: float) -> tuple[np.ndarray, np.ndarray]:
        """Half-widths (sampling, chance), (places,) each."""
        sampling = t_quantile(confidence, self.freedom) * self.sampling
        if len(self.values) < 2:
            return np.hypot(sampling, self.drift), np.zeros_like(sampling)
        total = t_quantile(confidence, len(self.values) - 1) * self.apart
        chance = np.sqrt(np.maximum(total**2 - sampling**2, 0.0))
        return np.hypot(sampling, self.drift), chance


@dataclass(frozen=True, eq=False)
class Estimate:
    """A goal's value (places,) with its error parts. fine, coarse: the values at two steps.

    step_is_seen: whether the steps differ by more than chance. grid: half-width by the frequencies
    between which a peak lies, which is part of the sampling.
    """

    goal: Goal
    value: np.ndarray
    parts: ErrorParts
    fine: SeedValues
    coarse: SeedValues
    step_is_seen: bool
    grid: np.ndarray

    def __repr__(self) -> str:
        return by_fields(self)


def estimate(
    goal: Goal,
    fine: SeedValues,
    coarse: SeedValues,
    grid: np.ndarray,
    ratio: float,
    order: float,
    confidence: float,
) -> Estimate:
    """Estimate of a goal at a step, and at one that is ``ratio`` times as long."""
    sampling, chance = fine.bars(confidence)
    change = np.abs(fine.mean - coarse.mean)
    step = step_error(change, ratio, order)
    known = sum(np.maximum(one.sampling, one.apart) ** 2 for one in (fine, coarse))
    is_seen = bool((change > 2.0 * np.sqrt(known)).any())
    parts = ErrorParts(step=step, chance=chance, sampling=np.hypot(sampling, grid))
    return Estimate(goal, fine.mean, parts, fine, coarse, is_seen, grid)


def step_error(change: Any, ratio: float, order: float) -> Any:
    """Error of a value at a step that changes by so much at one that is ``ratio`` times as long."""
    return SAFETY * change / (ratio**order - 1.0)


def seed_values(
    goal: Goal,
    runs: SceneRuns,
    ratios: Sequence[float],
    seeds: Sequence[int],
    dt: float,
    steady: Mapping[SceneKey, SteadyPart],
) -> SeedValues:
    """Values of a goal at a step [s], with the errors of their cycles by leaving parts out."""
    begins = {key: part.begin for key, part in steady.items()}
    values = goal.values(response_of(runs, ratios, seeds, dt, begins))
    without = goal.values(response_of(runs, ratios, seeds, dt, begins, BATCHES))
    places = values.shape[1]
    apart = without.reshape(len(seeds), BATCHES, places)
    apart = apart - apart.mean(axis=1, keepdims=True)
    variance = ((BATCHES - 1) / BATCHES * (apart**2).sum(axis=1)).mean(axis=0)
    keys = [SceneKey(ratio, seed, dt) for ratio in ratios for seed in seeds]
    more = np.mean([_correlated(runs.series(key)[0][begins[key] :]) for key in keys])
    drift = max(_share(steady[key]) for key in keys) * np.abs(values.mean(axis=0))
    return SeedValues(values, more * variance, len(seeds) * (BATCHES - 1), drift)


def _correlated(series):
    return correlation_factor(series, BATCHES, len(series) // BATCHES)


def _share(part):
    """Drift of a scene as a share of its mean; all of it where no limit can be seen."""
    size = abs(part.mean)
    return min(1.0, part.drift / size) if part.drift > 0.0 and size > 0.0 else 0.0


def response_of(
    runs: SceneRuns,
    ratios: Sequence[float],
    seeds: Sequence[int],
    dt: float,
    begins: Mapping[SceneKey, int],
    leave_out: int = 0,
) -> Response:
    """Response of the steady parts of scenes, from the cycles ``begins`` on.

    leave_out: equal parts, each of which is left out in turn: its seeds are then (seed, part).
    """
    rows: list[list[dict[str, Any]]] = []
    for ratio in ratios:
        keys = [SceneKey(ratio, seed, dt) for seed in seeds]
        rows.append([runs.measures(key, begins[key], leave_out) for key in keys])
    values: dict[str, Any] = {
        name: np.stack([np.concatenate([one[name] for one in row]) for row in rows])[None]
        for name in UNITS
    }
    named = tuple(seeds) if not leave_out else tuple(range(len(seeds) * leave_out))
    return _response(runs, ratios, named, dt, values)


def series_of(goal: Goal, runs: SceneRuns, key: SceneKey) -> np.ndarray:
    """A goal by cycle, of one that is made of the frequency of this scene alone, (cycles,)."""
    values = {name: value[None, None] for name, value in runs.by_cycle(key).items()}
    named = tuple(range(runs.cycles(key)))
    return goal.values(_response(runs, (key.ratio,), named, key.dt, values))[:, 0]


def _response(runs, ratios, seeds, dt, values):
    """Response of measures by name, (1, ratios, seeds) each."""
    steps = np.array([runs.steps_per_cycle(ratio, dt) for ratio in ratios])
    axis = np.array(ratios)
    lengths = 1.0 / (axis * runs.oscillator.natural_frequency * steps)
    places = (runs.particles,), axis, seeds
    return Response(runs.filling.label, runs.oscillator, *places, steps, lengths, **values)


def size_of(value: Values) -> float:
    """Largest magnitude of a value; NaN where one is no number."""
    return float(np.abs(value).max()) if np.isfinite(value).all() else math.nan
