"""Scenes that go on until each is steady, as far as a budget allows."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ca_damper.accuracy.scene_runs import SceneKey, SceneRuns
from ca_damper.steady_state import BATCHES, SteadyPart, steady_part

# Cycles of a scene after which it is taken as it is, with what its drift is known to be.
_MOST_CYCLES = 20_000


class BudgetSpent(Exception):
    """The next runs would take more than is left. needed: what they would take in all [s]."""

    def __init__(self, needed: float):
        super().__init__(needed)
        self.needed = needed


class SteadyRuns:
    """Steady parts of scenes, by SceneKey.

    budget_s: CPU seconds that all runs may take. further: gives series by cycle, beside RMS and
    amplitude, that must be steady in a scene.
    """

    def __init__(
        self,
        runs: SceneRuns,
        budget_s: float,
        further: Callable[[SceneKey], list[np.ndarray]],
    ):
        self.runs, self.budget_s, self.further = runs, budget_s, further
        self.parts: dict[SceneKey, SteadyPart] = {}

    def begins(self) -> dict[SceneKey, int]:
        """Cycle from which on each scene is steady, in whole batches."""
        return {key: self._begin(key, part.begin) for key, part in self.parts.items()}

    def _begin(self, key, begin):
        return begin + (self.runs.cycles(key) - begin) % BATCHES

    def is_full(self, keys: Iterable[SceneKey]) -> bool:
        """Whether no scene may go on any further."""
        return min(map(self.runs.cycles, keys)) >= _MOST_CYCLES

    def go_on(self, keys: Iterable[SceneKey], drift: float, least: int, window: int) -> None:
        """Let scenes go on until each is steady for a window of cycles.

        drift: that does not matter, as a share of the value. least: cycles of each scene.
        Raises BudgetSpent before runs that would take too long.
        """
        scenes = tuple(keys)
        while True:
            more = {key: self._missing(key, drift, least, window) for key in scenes}
            more = {key: count for key, count in more.items() if count > 0}
            if not more:
                return
            self._check_budget(more)
            self.runs.go_on(more)

    def _check_budget(self, more: Mapping[SceneKey, int]) -> None:
        """Raise BudgetSpent where runs would take too long; two cycles tell their speed."""
        if self.budget_s == math.inf:
            return
        if not self.runs.steps:
            for _ in range(2):
                self.runs.go_on(dict.fromkeys(more, 1))
        needed = self.runs.cpu_s + self.runs.seconds(more)
        if needed > self.budget_s:
            raise BudgetSpent(needed)

    def _missing(self, key, drift, least, window):
        """Cycles that a scene has to go on by before it can be judged, or is good enough."""
        gone = self.runs.cycles(key)
        if gone < least:
            return least - gone
        part = self.check_steady(key, drift)
        if gone >= _MOST_CYCLES:
            return 0
        if not part.is_steady:
            return min(_rounded(part.more), _MOST_CYCLES - gone)
        return min(_rounded(1.25 * (window - (gone - part.begin))), _MOST_CYCLES - gone)

    def check_steady(self, key: SceneKey, drift: float) -> SteadyPart:
        """Check by all of its cycles from when on a scene is steady."""
        series = [*self.runs.series(key), *self.further(key)]
        part = self.parts[key] = _steady(series, drift)
        return part


def _steady(series: Sequence[np.ndarray], drift: float) -> SteadyPart:
    """Steady part of the first series, where the others are steady too; each (cycles,)."""
    parts = [steady_part(row, drift) for row in series if np.isfinite(row).all()]
    first = parts[0]
    shares = [part.drift / abs(part.mean) for part in parts if part.mean != 0.0]
    return replace(
        first,
        is_steady=all(part.is_steady for part in parts),
        begin=max(part.begin for part in parts),
        drift=abs(first.mean) * max(shares, default=0.0),
        more=max(part.more for part in parts),
    )


def _rounded(cycles: float) -> int:
    """A number of cycles in eighths of a run, at least 0."""
    return max(0, 8 * math.ceil(cycles / 8.0))
