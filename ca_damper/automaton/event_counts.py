"""Counts of events by rule of the automaton."""

import numpy as np
import taichi as ti

from ca_damper.scenes.scene_fields import SceneFields
from taichi_dem.kit.effect_usage import EffectUse

PAIRS, WALLS, PUSHES, HOLDS = range(4)
#: Counted events by the effect that they belong to.
_COUNTED = {
    "pairs": (PAIRS, "pairs met"),
    "landing": (WALLS, "blows to walls"),
    "ejection": (PUSHES, "particles pushed along"),
    "static contact": (HOLDS, "particles came to rest"),
}


@ti.data_oriented
class EventCounts:
    """Events since the reset and the step of the first, shape (scenes, kinds of event).

    step: the present one, (scenes,).
    """

    def __init__(self, table: SceneFields):
        self.table = table
        self.events = table.field(ti.i64, HOLDS + 1)
        self.first = table.field(ti.i32, HOLDS + 1)
        self.step = table.field(ti.i32)

    @ti.func
    def clear(self, s):
        """Nothing has happened yet."""
        for kind in range(HOLDS + 1):
            self.events[s, kind] = ti.cast(0, ti.i64)

    @ti.func
    def begin(self, s, step):
        """Note which step begins."""
        self.step[s] = step

    @ti.func
    def note(self, s, kind):
        """Count one event."""
        if self.events[s, kind] == 0:
            self.first[s, kind] = self.step[s]
        # Not "+=", which would be an atomic addition; a scene is one thread.
        self.events[s, kind] = self.events[s, kind] + 1

    def first_steps(self, effects: tuple[str, ...]) -> dict[str, np.ndarray]:
        """Step in which each counted effect first acted, infinite if never, (scenes,)."""
        first, events = map(self.table.in_use, (self.first, self.events))
        steps = np.where(events > 0, first.astype(np.float64), np.inf)
        return {name: steps[:, _COUNTED[name][0]] for name in effects if name in _COUNTED}

    def uses(self, effects: tuple[str, ...]) -> tuple[EffectUse, ...]:
        """An EffectUse for each named effect that is an event, over all scenes.

        The automaton keeps no account of energy: what it does steers.
        """
        total = self.table.in_use(self.events).sum(axis=0)
        found = [(name, *_COUNTED[name]) for name in effects if name in _COUNTED]
        return tuple(EffectUse(name, what, int(total[k]), steers=True) for name, k, what in found)
