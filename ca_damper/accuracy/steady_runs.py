"""Scenes that go on until they are steady, as far as a budget allows.

The seeds of one frequency and step go on together, each for as many cycles: one that stopped where
it looks steady would stop in the quieter of several motions more often than it takes it.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from ca_damper.accuracy.scene_runs import SceneKey, SceneRuns
from ca_damper.report.steady_state import BATCHES, SteadyPart, steady_part

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
        """Let scenes go on until all seeds are steady for a window of cycles.

        drift: that does not matter, as a share of the value. least: cycles of each scene.
        Raises BudgetSpent before runs that would take too long.
        """
        groups = _groups(keys)
        while True:
            more: dict[SceneKey, int] = {}
            for group in groups:
                more.update(self._missing(group, drift, least, window))
            if not more:
                return
            self._go_within_budget(more)

    def _go_within_budget(self, more: dict[SceneKey, int]) -> None:
        """Let scenes go on by so many cycles; BudgetSpent where they would take too long.

        The first two of the cycles tell the speed: nothing is run that would not be without budget.
        """
        if self.budget_s < math.inf:
            for _ in range(0 if self.runs.steps else 2):
                first = {key: 1 for key, count in more.items() if count > 0}
                self.runs.go_on(first)
                more = {key: count - first.get(key, 0) for key, count in more.items()}
            needed = self.runs.cpu_s + self.runs.seconds(more)
            if needed > self.budget_s:
                raise BudgetSpent(needed)
        self.runs.go_on(more)

    def _missing(self, group, drift, least, window):
        """Cycles by which seeds have to go on before they can be judged, or are good enough."""
        gone = max(least, *map(self.runs.cycles, group))
        late = {key: gone - self.runs.cycles(key) for key in group if self.runs.cycles(key) < gone}
        if late:
            return late
        part = self._check(group, drift)
        more = 1.25 * (window - (gone - part.begin)) if part.is_steady else part.more
        count = min(_rounded(more), _MOST_CYCLES - gone)
        return dict.fromkeys(group, count) if count > 0 else {}

    def check_steady(self, keys: Iterable[SceneKey], drift: float) -> None:
        """Check by the cycles that all seeds have from when on they are steady."""
        for group in _groups(keys):
            self._check(group, drift)

    def _check(self, group, drift):
        shortest = min(map(self.runs.cycles, group))
        series = [(*self.runs.series(key), *self.further(key)) for key in group]
        rows = [np.stack([one[:shortest] for one in seeds]) for seeds in zip(*series)]
        part = _steady(rows, drift)
        self.parts.update(dict.fromkeys(group, part))
        return part


def _groups(keys: Iterable[SceneKey]) -> list[list[SceneKey]]:
    """Scenes that differ by their seeds alone."""
    groups: dict[tuple[float, float], list[SceneKey]] = {}
    for key in keys:
        groups.setdefault((key.ratio, key.dt), []).append(key)
    return list(groups.values())


def _steady(series: Sequence[np.ndarray], drift: float) -> SteadyPart:
    """Steady part of the first series, where the others are too; each (seeds, cycles)."""
    parts = [steady_part(rows, drift) for rows in series if np.isfinite(rows).all()]
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
