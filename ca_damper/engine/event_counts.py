"""Counts of events by kind, and the step of the first."""

from collections.abc import Mapping

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class EventCounts:
    """Events since the reset and the step of the first, shape (scenes, kinds of event).

    kinds: number of them. by: kinds by the name of the effect that acts by them. step: the present
    one, (scenes,).
    """

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
