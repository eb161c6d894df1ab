"""Records of a run by kernels: samples at even intervals, and events by kind."""

from collections.abc import Mapping

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.allocation import assign

#: Quantities kept of all samples: the force is the filling's mean since the sample before.
SERIES = ("x", "v", "y", "force")
#: Quantities kept of the last samples only, and their number; the force is that of the last step.
LATEST, ROOM = ("a", "force", "energy", "momentum"), 32


@ti.data_oriented
class SampleRecorder:
    """Samples of every scene, every so many steps of a run."""

    def __init__(self, table: SceneFields):
        self.table = table
        self.every, self.late = ti.field(ti.i32, shape=()), ti.field(ti.i32, shape=())
        self.series = table.vector(len(SERIES), ti.f64, "samples")
        self.latest = table.vector(len(LATEST), ti.f64, ROOM)
        self.pushed = table.field(ti.f64)

    def aim(self, every: int, late: int) -> None:
        """Set the steps between samples of the next run, and those before it since the last."""
        assign(self.every, every)
        assign(self.late, late)

    @ti.func
    def note(self, s, step, motion, force, quantities: ti.template()):
        """Take a sample at the beginning of a step of the run, if one is due; force: before it."""
        every, since = self.every[None], self.late[None] + step
        if every > 0:
            total = self.pushed[s] + force
            if since % every == 0:
                k, mean = since // every, force if step == 0 else total / every
                x, v, a, y, last, energy, momentum = quantities(s, motion)
                self.series[s, k] = ti.Vector([x, v, y, mean])
                self.latest[s, k % ROOM] = ti.Vector([a, last, energy, momentum])
                total = 0.0
            self.pushed[s] = total

    def read_series(self, first: int, end: int) -> dict[str, np.ndarray]:
        """Samples in places from first to before end, (samples, scenes) by the names of SERIES."""
        return dict(zip(SERIES, self.table.in_use(self.series)[:, first:end].transpose(2, 1, 0)))

    def read(self, first: int, end: int) -> dict[str, np.ndarray]:
        """The same by those of ``measures.SAMPLE``, of the last ROOM samples at most."""
        latest = self.table.in_use(self.latest)[:, np.arange(first, end) % ROOM]
        return {**self.read_series(first, end), **dict(zip(LATEST, latest.transpose(2, 1, 0)))}

    def mean_force(self, last: np.ndarray, steps: int) -> np.ndarray:
        """Mean force since the last sample, so many steps ago; last: that of the last step."""
        pushed: np.ndarray = self.table.in_use(self.pushed)
        return (pushed + last) / steps


@ti.data_oriented
class EventCounts:
    """Events since the reset and the step of the first, shape (scenes, kinds of event)."""

    def __init__(self, table: SceneFields, kinds: int, by: Mapping[str, tuple[int, ...]]):
        self.table, self.kinds, self.by, self.step = table, kinds, by, table.field(ti.i32)
        self.events, self.first = table.field(ti.i64, kinds), table.field(ti.i32, kinds)

    @ti.func
    def clear(self, s):
        """Nothing has happened yet."""
        for kind in range(self.kinds):
            self.events[s, kind] = ti.cast(0, ti.i64)

    @ti.func
    def is_new(self, s, kind):
        """Whether something has not happened yet."""
        return self.events[s, kind] == 0

    @ti.func
    def note(self, s, kind):
        """Count one event."""
        if self.is_new(s, kind):
            self.first[s, kind] = self.step[s]
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.events[s, kind] = self.events[s, kind] + 1

    def total(self, kind: int) -> int:
        """Number of events of a kind in all scenes."""
        return int(self.table.in_use(self.events)[:, kind].sum())

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each of these effects first acted, infinite if never, (scenes,)."""
        first, events = map(self.table.in_use, (self.first, self.events))
        steps = np.where(events > 0, first.astype(np.float64), np.inf)
        known = [name for name in effects if name in self.by]
        return {name: steps[:, list(self.by[name])].min(axis=1) for name in known}
