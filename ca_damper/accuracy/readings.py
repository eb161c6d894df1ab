"""Goals of the steady parts of scenes: values, and what their frequencies do."""

from collections.abc import Sequence

import numpy as np

from ca_damper.accuracy.runs import SceneKey, SteadyRuns
from ca_damper.goals import Goal
from ca_damper.report.measures import MEASURE_UNITS
from ca_damper.runs.response import Response


class SteadyReadings:
    """Goals of the steady parts of scenes."""

    def __init__(self, steady: SteadyRuns):
        self.steady, self.runs = steady, steady.runs

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
        without = [[left_out for left_out in everywhere if left_out != ratio] for ratio in inside]
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
        changed = np.any([np.abs(value - whole) > 0.0 for value in without], axis=0)
        return bool((changed.mean(axis=0) > 0.5).any())

    def series(self, goal: Goal, key: SceneKey) -> np.ndarray:
        """A goal by cycle, of one that is made of the frequency of this scene alone, (cycles,)."""
        values = {name: value[None, None] for name, value in self.runs.by_cycle(key).items()}
        named = tuple(range(self.runs.cycles(key)))
        return goal.values(self._made((key.ratio,), named, key.dt, values))[:, 0]

    def response(self, ratios: Sequence[float], seeds: Sequence[int], dt: float) -> Response:
        """Response of the steady parts of scenes at a step [s]."""
        rows = []
        for ratio in ratios:
            keys = [SceneKey(ratio, seed, dt) for seed in seeds]
            rows.append([self.runs.measures(key, self.steady.parts[key].begin) for key in keys])
        values = {
            name: np.stack([np.concatenate([measures[name] for measures in row]) for row in rows])[
                None
            ]
            for name in MEASURE_UNITS
        }
        return self._made(ratios, tuple(seeds), dt, values)

    def drift(self, ratios: Sequence[float], seeds: Sequence[int], dt: float) -> float:
        """Largest drift of scenes, as a share of their RMS."""
        keys = [SceneKey(ratio, seed, dt) for ratio in ratios for seed in seeds]
        return max(_share(self.steady.parts[key]) for key in keys)

    def _made(self, ratios, seeds, dt, values):
        """Response of measures by name, (1, ratios, seeds) each."""
        runs, axis = self.runs, np.array(ratios)
        steps = np.array([runs.steps_per_cycle(ratio, dt) for ratio in ratios])
        places = (runs.particles,), axis, seeds
        return Response(runs.filling.label, runs.oscillator, *places, steps, **values)


def _share(part):
    """Drift of a scene as a share of its mean; all of it where no limit can be seen."""
    size = abs(part.mean)
    return min(1.0, part.drift / size) if part.drift > 0.0 and size > 0.0 else 0.0
