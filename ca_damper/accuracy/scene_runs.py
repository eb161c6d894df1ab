"""Scenes of one filling that go on from where they are, each as far as it is asked to."""

import math
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ca_damper.batch import Batch
from ca_damper.oscillator import Oscillator
from ca_damper.report.measures import COLUMNS, Cycles
from ca_damper.runs.response import measures_of
from ca_damper.scenes.clock import steps_per_cycle
from ca_damper.scenes.table import SceneTable
from taichi_dem.kit.progress.progress import Listener

#: Scenes of a batch and cycles of a run: an engine has room for so many at least, so that further
#: batches of the same filling compile nothing.
SCENES, CYCLES = 64, 32


class SceneKey(NamedTuple):
    """Which scene: frequency ratio f/f0, seed, largest step [s]."""

    ratio: float
    seed: int
    dt: float


@dataclass(eq=False)
class _Home:
    """Scenes of one batch; aside: their state while another batch runs."""

    table: SceneTable
    aside: Any = None


class SceneRuns:
    """Records of scenes of a filling with a number of particles, by SceneKey.

    cpu_s: CPU seconds of their runs, without compiling. steps: of all scenes. runs: number of
    scenes started.
    """

    def __init__(
        self, filling: Any, particles: int, oscillator: Oscillator, progress: Listener | None
    ):
        self.filling, self.particles, self.oscillator = filling, particles, oscillator
        self.progress = progress
        self.cpu_s, self.steps, self._pace = 0.0, 0, math.inf
        self._homes: dict[SceneKey, tuple[_Home, int]] = {}
        self._present: tuple[_Home, Batch] | None = None
        self._records: dict[SceneKey, np.ndarray] = {}

    @property
    def runs(self) -> int:
        """Number of scenes that were started."""
        return len(self._records)

    @property
    def failures(self) -> list[str]:
        """Why certificates of the runs do not hold, and what would settle it."""
        homes = dict.fromkeys(home for home, _ in self._homes.values())
        return sorted({self._batch(home).certificate.failure for home in homes})

    def cycles(self, key: SceneKey) -> int:
        """Number of cycles that a scene has gone."""
        return len(self._records[key]) if key in self._records else 0

    def work(self, cycles: Mapping[SceneKey, int]) -> int:
        """Steps that scenes take to go on by so many cycles."""
        return sum(count * self._steps(key) for key, count in cycles.items())

    def steps_per_cycle(self, ratio: float, dt: float) -> int:
        """Steps of a cycle at a frequency ratio, none longer than dt [s]."""
        return steps_per_cycle(ratio * self.oscillator.natural_frequency, dt)

    def _steps(self, key):
        return self.steps_per_cycle(key.ratio, key.dt)

    def seconds(self, cycles: Mapping[SceneKey, int]) -> float:
        """CPU seconds that they will take, by the fastest so far; 0 before the first."""
        return self._pace * self.work(cycles) if self.steps else 0.0

    def go_on(self, cycles: Mapping[SceneKey, int]) -> None:
        """Let scenes go on by numbers of cycles; those not known begin at rest.

        Raises SimulationDiverged; the scenes of that batch are then lost.
        """
        self._begin([key for key, count in cycles.items() if count and key not in self._homes])
        homes: dict[_Home, dict[int, SceneKey]] = {}
        for key, count in cycles.items():
            if count:
                home, s = self._homes[key]
                homes.setdefault(home, {})[s] = key
        for home, keys in homes.items():
            self._go(self._batch(home), keys, {s: cycles[key] for s, key in keys.items()})

    def _begin(self, keys):
        """Make tables of new scenes."""
        for first in range(0, len(keys), SCENES):
            some = keys[first : first + SCENES]
            ratios, seeds, steps = (np.array(column) for column in zip(*some))
            o = self.oscillator
            structure = (o.base_amplitude, o.mass, o.stiffness, o.damping)
            frequency = ratios * o.natural_frequency
            home = _Home(SceneTable(self.particles, seeds, steps, frequency, *structure))
            self._homes.update({key: (home, s) for s, key in enumerate(some)})
            self._records.update({key: np.empty((0, len(COLUMNS))) for key in some})

    def _batch(self, home):
        """The batch of some scenes, which begin at rest; the state of all others is kept aside."""
        if self._present is None or self._present[0] is not home:
            self._put_aside()
            batch = Batch(self.filling, home.table, measured_cycles=CYCLES, if_diverged="raise")
            if home.aside is None:
                batch.start("rest")
                # Compiles, where no batch of this structure has done so.
                batch.advance(0)
            else:
                batch.take_up(home.aside)
            self._present = home, batch
        return self._present[1]

    def _put_aside(self):
        """Leave the engine to the next batch."""
        if self._present is not None:
            home, batch = self._present
            home.aside, self._present = batch.aside(), None

    def _go(self, batch, keys, left):
        """Let scenes of a batch go on, by ``CYCLES`` at a time at most."""
        while any(left.values()):
            now = {s: min(CYCLES, count) for s, count in left.items()}
            counts = np.zeros(batch.count, dtype=np.int64)
            counts[list(now)] = list(now.values())
            began = time.process_time()
            records = batch.measure_each(counts, self.progress)
            spent, steps = time.process_time() - began, int((counts * batch.steps_per_cycle).sum())
            self.cpu_s, self.steps = self.cpu_s + spent, self.steps + steps
            # The first runs of a process take longer.
            self._pace = min(self._pace, spent / steps)
            for s, key in keys.items():
                self._records[key] = np.concatenate([self._records[key], records[s]])
                left[s] -= now[s]

    def forget(self, keys: Iterable[SceneKey]) -> None:
        """Give scenes up that have diverged, with those that shared their batch."""
        lost = {self._homes[key][0] for key in keys if key in self._homes}
        for key in [key for key, (home, _) in self._homes.items() if home in lost]:
            del self._homes[key], self._records[key]

    def series(self, key: SceneKey) -> np.ndarray:
        """RMS and amplitude of every cycle of a scene [m], (2, cycles)."""
        cycles = self._cycles(key, self._records[key][:, None])
        return np.stack([cycles.rms, cycles.amplitude])

    def by_cycle(self, key: SceneKey) -> dict[str, np.ndarray]:
        """Measures of every cycle of a scene, each (cycles,), by name."""
        return measures_of(self.oscillator, self._cycles(key, self._records[key][:, None]))

    def measures(self, key: SceneKey, begin: int, leave_out: int = 0) -> dict[str, np.ndarray]:
        """Measures of a scene from cycle ``begin`` on, each (1,), by name.

        leave_out: number of equal parts, each of which is left out in turn: (parts,).
        """
        record = self._records[key][begin:]
        if not leave_out:
            return measures_of(self.oscillator, self._cycles(key, record[None]))
        length = len(record) // leave_out
        kept = record[len(record) - leave_out * length :]
        part = np.arange(len(kept)) // length
        without = np.stack([kept[part != k] for k in range(leave_out)])
        return measures_of(self.oscillator, self._cycles(key, without))

    def _cycles(self, key, record):
        frequency = np.full(len(record), key.ratio * self.oscillator.natural_frequency)
        return Cycles(frequency, np.full(len(record), self._steps(key)), record)
