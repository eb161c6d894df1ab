"""Scenes of one filling that continue from their state until they are steady."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ca_damper.batch import Batch
from ca_damper.fixed_mass import Empty, RigidMass
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import COLUMNS, Cycles
from ca_damper.report.steady_state import SteadyPart, steady_part
from ca_damper.runs.response import measures_of
from ca_damper.scenes.clock import automatic_dt, steps_per_cycle
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.bars.runs import BudgetSpent
from taichi_dem.kit.progress import Listener

#: Scenes of a batch and cycles of a run: an engine has room for so many at least, so that further
#: batches of the same filling compile nothing.
SCENES, CYCLES = 64, 32
#: Fillings that begin in their steady state.
GLUED = Empty, RigidMass
# Cycles of a scene after which it is taken as it is, with what its drift is known to be.
_MOST_CYCLES = 20_000


class SceneKey(NamedTuple):
    """Which scene: frequency ratio f/f0, seed, largest step [s]."""

    ratio: float
    seed: int
    dt: float

    @property
    def coarser(self) -> "SceneKey":
        """The same scene at twice the step."""
        return self._replace(dt=2.0 * self.dt)


@dataclass(eq=False)
class _Home:
    """Scenes of one batch; aside: their state while another batch runs.

    source, rows: batch and scenes that they go on from, None where they begin anew.
    """

    table: SceneTable
    source: Any
    rows: list[int]
    aside: Any = None


class SceneRuns:
    """Records of scenes of a filling, by SceneKey; cpu_s: CPU seconds without compiling."""

    def __init__(
        self, filling: Any, particles: int, oscillator: Oscillator, progress: Listener | None
    ):
        self.filling, self.particles, self.oscillator = filling, particles, oscillator
        self.progress, self.start = progress, "rigid" if isinstance(filling, GLUED) else "rest"
        self.cpu_s, self.steps, self._pace = 0.0, 0, math.inf
        self._homes: dict[SceneKey, tuple[_Home, int]] = {}
        self._present: tuple[_Home, Batch] | None = None
        self._records: dict[SceneKey, np.ndarray] = {}

    @property
    def runs(self) -> int:
        """Number of scenes that were started."""
        return len(self._records)

    def forget(self) -> None:
        """Let no further scene go on from those that were run."""
        self._homes.clear()

    def cycles(self, key: SceneKey) -> int:
        """Number of cycles that a scene has gone."""
        return len(self._records[key]) if key in self._records else 0

    def longest(self) -> int:
        """Most cycles that a scene has gone."""
        return max(map(len, self._records.values()))

    def steps_per_cycle(self, ratio: float, dt: float) -> int:
        """Steps of a cycle at a frequency ratio, none longer than dt [s]."""
        frequency = ratio * self.oscillator.natural_frequency
        return steps_per_cycle(frequency, automatic_dt(dt, frequency))

    def seconds(self, cycles: Mapping[SceneKey, int]) -> float:
        """CPU seconds of so many further cycles, by the fastest so far; 0 before the first."""
        steps = sum(n * self.steps_per_cycle(key.ratio, key.dt) for key, n in cycles.items())
        return self._pace * steps if self.steps else 0.0

    def go_on(self, cycles: Mapping[SceneKey, int]) -> None:
        """Let scenes go on by numbers of cycles.

        One that is not known goes on from where it is at twice the step, or begins.
        """
        left = {key: count for key, count in cycles.items() if count}
        self._begin([key for key in left if key not in self._homes])
        homes: dict[_Home, dict[SceneKey, int]] = {}
        for key in left:
            home, s = self._homes[key]
            homes.setdefault(home, {})[key] = s
        for home, rows in homes.items():
            self._go(self._batch(home), rows, left)

    def _begin(self, keys):
        """Put scenes into batches; those that go on from the scenes of one batch share one."""
        sources: dict[_Home | None, list[SceneKey]] = {}
        for key in keys:
            sources.setdefault(self._homes.get(key.coarser, (None, 0))[0], []).append(key)
        for source, some in sources.items():
            for first in range(0, len(some), SCENES):
                self._begin_batch(source, some[first : first + SCENES])

    def _begin_batch(self, source, keys):
        ratios, seeds, longest = (np.array(column) for column in zip(*keys))
        o = self.oscillator
        structure = (o.base_amplitude, o.mass, o.stiffness, o.damping)
        frequency = ratios * o.natural_frequency
        steps = [automatic_dt(*pair) for pair in zip(longest.tolist(), frequency.tolist())]
        table = SceneTable(self.particles, seeds, steps, frequency, *structure)
        rows = [self._homes[key.coarser][1] for key in keys] if source else []
        home = _Home(table, source, rows)
        self._homes.update({key: (home, s) for s, key in enumerate(keys)})
        self._records.update({key: np.empty((0, len(COLUMNS))) for key in keys})

    def _batch(self, home):
        """The batch of some scenes; the state of all others is kept aside."""
        if self._present is not None and self._present[0] is home:
            return self._present[1]
        if self._present is not None:
            # The engine is for the next batch.
            other, batch = self._present
            other.aside, self._present = batch.aside(), None
        batch = Batch(self.filling, home.table, measured_cycles=CYCLES, if_diverged="raise")
        if home.aside is not None:
            batch.take_up(home.aside)
        elif home.source is not None:
            batch.take_up(home.source.aside, home.rows)
        else:
            batch.start(self.start)
            # Compiles, where no batch of this structure has done so.
            batch.advance(0)
        self._present = home, batch
        return batch

    def _go(self, batch, rows, left):
        """Let scenes of a batch go on, by ``CYCLES`` at a time at most; rows: of its table."""
        while any(left[key] for key in rows):
            counts = np.zeros(batch.count, dtype=np.int64)
            for key, s in rows.items():
                counts[s] = min(CYCLES, left[key])
                left[key] -= int(counts[s])
            began = time.process_time()
            records = batch.measure_each(counts, self.progress)
            spent, steps = time.process_time() - began, int((counts * batch.steps_per_cycle).sum())
            self.cpu_s, self.steps = self.cpu_s + spent, self.steps + steps
            # The first runs of a process take longer.
            self._pace = min(self._pace, spent / steps)
            for key, s in rows.items():
                self._records[key] = np.concatenate([self._records[key], records[s]])

    def by_cycle(self, key: SceneKey) -> dict[str, np.ndarray]:
        """Measures of every cycle of a scene, each (cycles,), by name."""
        return measures_of(self.oscillator, self._cycles(key, self._records[key][:, None]))

    def measures(self, key: SceneKey, begin: int) -> dict[str, np.ndarray]:
        """Measures of a scene from cycle ``begin`` on, each (1,), by name."""
        return measures_of(self.oscillator, self._cycles(key, self._records[key][begin:][None]))

    def _cycles(self, key, record):
        frequency = np.full(len(record), key.ratio * self.oscillator.natural_frequency)
        steps = np.full(len(record), self.steps_per_cycle(key.ratio, key.dt))
        return Cycles(frequency, steps, record)


class SteadyRuns:
    """Steady parts of scenes, by SceneKey; further: gives more series that must be steady.

    share: of the budget, which may be used.
    """

    def __init__(
        self,
        runs: SceneRuns,
        budget_s: float,
        further: Callable[[SceneKey], list[np.ndarray]],
    ):
        self.runs, self.budget_s, self.further = runs, budget_s, further
        self.parts: dict[SceneKey, SteadyPart] = {}
        self.share = 1.0

    def go_on(self, keys: Iterable[SceneKey], drift: float, least: int, window: int) -> None:
        """Let scenes go on until all seeds are steady for a window of cycles.

        Where the budget ends, those that have gone so many as least are taken as they are.
        """
        groups = _groups(keys)
        while True:
            more: dict[SceneKey, int] = {}
            for group in groups:
                more.update(self._missing(group, drift, least, window))
            if not more:
                return
            try:
                self._go_within_budget(more)
            except BudgetSpent:
                if min(self.runs.cycles(key) for group in groups for key in group) < least:
                    raise
                for group in groups:
                    self._check(group, drift)
                return

    def _go_within_budget(self, more: dict[SceneKey, int]) -> None:
        """Let scenes go on by so many cycles; BudgetSpent where they would take too long."""
        # The first two cycles tell the speed; a run without budget makes them too.
        if self.budget_s < math.inf:
            for _ in range(0 if self.runs.steps else 2):
                first = {key: 1 for key, count in more.items() if count > 0}
                self.runs.go_on(first)
                more = {key: count - first.get(key, 0) for key, count in more.items()}
            needed = self.runs.cpu_s + self.runs.seconds(more)
            if needed > self.share * self.budget_s:
                raise BudgetSpent(needed / self.share)
        self.runs.go_on(more)

    def _missing(self, group, drift, least, window):
        """Cycles by which seeds have to go on before they can be judged, or are good enough."""
        gone = max(least, *map(self.runs.cycles, group))
        late = {key: gone - self.runs.cycles(key) for key in group if self.runs.cycles(key) < gone}
        if late:
            return late
        part = self._check(group, drift)
        more = 1.25 * (window - (gone - part.begin)) if part.is_steady else part.more
        # In eighths of a run.
        count = min(8 * math.ceil(more / 8.0), _MOST_CYCLES - gone)
        return dict.fromkeys(group, count) if count > 0 else {}

    def _check(self, group, drift):
        shortest = min(map(self.runs.cycles, group))
        by_cycle = [(key, self.runs.by_cycle(key)) for key in group]
        series = [
            (values["rms"], values["amplitude"], *self.further(key)) for key, values in by_cycle
        ]
        rows = [np.stack([values[:shortest] for values in seeds]) for seeds in zip(*series)]
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
